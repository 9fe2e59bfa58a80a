#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "model/model.h"

namespace emtb {

/// A value that a parameter has where another effect takes the place of the one that was named.
struct OtherValue {
  std::size_t effect = 0;  ///< the other one
  std::string name;        ///< of the parameter, as in Model::names()
  double value = 0;        ///< [SI]
};

/// Adds to the standard errors of a model how far its values lie from those of others that the data do not tell from
/// it. A lag of the driver and an inductance explain the same transients with another R_a each: which of them is right
/// is not known, and so neither is R_a to better than their difference. The model and its n rivals are alike likely, so
/// that the mean square about the value of the model grows by the sum of (v_k - v)^2 / (n + 1). What one of them lacks,
/// holds or has pinned stays as it is.
/// @param fitted with standard errors
void widen_by_ties(std::span<const Model> rivals, Model& fitted);

/// The base parameters of a rival that differ by more than a hundredth and two standard errors of the model.
/// @param fitted as it was before it was widened
std::vector<OtherValue> values_that_differ(const Model& fitted, const Model& rival, std::size_t effect);

}  // namespace emtb
