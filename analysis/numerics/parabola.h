#pragma once

#include <algorithm>

namespace emtb {

/// Where a parabola through three values, a step apart, is lowest: in steps from the middle one, half a step at most.
/// @param least the middle one, which neither of its neighbours is below
inline double lowest_about(double before, double least, double after) {
  const double bend = before - 2 * least + after;
  return bend > 0 ? std::clamp(0.5 * (before - after) / bend, -0.5, 0.5) : 0;
}

}  // namespace emtb
