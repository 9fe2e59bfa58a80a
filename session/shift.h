#pragma once

#include <cmath>
#include <vector>

namespace emtb {

/// Moves times [s] so that `start` becomes zero.
///
/// The difference is rounded to the nanosecond, which undoes the rounding of the subtraction (3.2 - 1.1 is 2.1 again,
/// not 2.1000000000000001); not where that would make two times equal.
inline void shift_to_zero(std::vector<double>& t, double start) {
  if (start == 0) return;
  std::vector<double> rounded(t.size());
  bool increasing = true;
  for (std::size_t i = 0; i < t.size(); ++i) {
    t[i] -= start;
    rounded[i] = std::round(t[i] * 1e9) / 1e9;
    if (i > 0 && rounded[i] <= rounded[i - 1]) increasing = false;
  }
  if (increasing) t = std::move(rounded);
}

}  // namespace emtb
