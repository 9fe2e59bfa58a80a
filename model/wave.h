#pragma once

#include <cmath>

#include "model/dual.h"

namespace emtb {

/// The mean of a sine while its phase turns on by `turned`: what a step long against the wave must see, or it would
/// take single points of it for a slow wave.
/// @param phase [rad] in the middle @param turned [rad]
template <class Scalar>
Scalar mean_sine(const Scalar& phase, const Scalar& turned) {
  using std::sin;
  const Scalar half = 0.5 * turned, squared = half * half;
  constexpr double small = 0.1;  // of half^2, where the series is good to 1e-11
  const Scalar kept = value_of(squared) < small
                          ? 1.0 - squared * (1.0 / 6 - squared * (1.0 / 120 - squared * (1.0 / 5040)))
                          : sin(half) / half;
  return kept * sin(phase);
}

}  // namespace emtb
