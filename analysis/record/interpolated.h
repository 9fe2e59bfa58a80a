#pragma once

#include <cstddef>

#include "session/session.h"

namespace emtb {

/// Where a log holds more rows than an instrument read, and those between two readings lie on the straight line from
/// the one to the other.
struct StraightRows {
  std::size_t rows = 1;   ///< from one reading to the next; 1: it was read in every row
  std::size_t first = 0;  ///< row of the first reading that is sure to be one
};

/// Told by a signal that is straight to its last digits between rows at which it bends, at even distances.
StraightRows straight_rows(const Series& series);

/// The series without the rows that somebody put between the readings: these are no readings of their own.
Series without_straight_rows(const Series& series);

}  // namespace emtb
