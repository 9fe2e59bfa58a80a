#pragma once

#include "model/model.h"

namespace emtb {

/// Does a fitted parameter rest on a bound? It does where it is as near to the bound as makes no difference, a
/// millionth of its scale, and the data pull it outwards. The width of the bounds is no scale: those of effects are
/// physics' own, many orders wider than any value.
/// @param pull the parameter's component of Sᵀr: the sum of squares falls where it grows, for a positive one
/// @param scale by which a change of the parameter is told: its standard error, were all others known; not finite where
/// the data say nothing of it: then its own value
bool rests_on_bound(const Parameter& parameter, double pull, double scale);

}  // namespace emtb
