#pragma once

#include <cstddef>

#include "model/model.h"

namespace emtb {

/// [SI of the parameter] How large a parameter usually is: the size by which a change of it is called large or small.
/// Its fitted value; where it may be nothing and is, the value that the fit started from, or for an effect the
/// catalogue's `typical`, or for B what would matter (natural_size()). The width of the bounds is no size: those of
/// effects are physics' own, many orders wider than any value.
/// @param fitted holds the fitted values, `start` those from which the fit started; of the same structure
double typical_size(const Model& fitted, const Model& start, std::size_t place);

/// [SI of the parameter] The size from which a parameter that may be nothing makes a difference to the motion: of B
/// what damps the shaft as much as the armature's own circuit does, K_b K_m/R_a, or with a current drive, what brakes
/// within a second. Of all others typical_size().
double natural_size(const Model& fitted, const Model& start, std::size_t place);

}  // namespace emtb
