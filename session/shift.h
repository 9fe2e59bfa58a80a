#pragma once

#include <cmath>
#include <vector>

#include "hal/shared_column.h"

namespace emtb {

/// Moves times [s] so that `start` becomes zero.
///
/// The difference is rounded to the nanosecond, which undoes the rounding of the subtraction (3.2 - 1.1 is 2.1 again,
/// not 2.1000000000000001); not where that would make two times equal.
inline void shift_to_zero(SharedColumn<double>& t, double start) {
  if (start == 0) return;
  std::vector<double> shifted(t.size()), rounded(t.size());
  bool increasing = true;
  for (std::size_t i = 0; i < t.size(); ++i) {
    shifted[i] = t[i] - start;
    rounded[i] = std::round(shifted[i] * 1e9) / 1e9;
    if (i > 0 && rounded[i] <= rounded[i - 1]) increasing = false;
  }
  t = increasing ? std::move(rounded) : std::move(shifted);
}

}  // namespace emtb
