#pragma once

#include <limits>

namespace emtb {

/// How a device's own clock runs against the loop's, as the arrivals of its samples tell.
///
/// Arrivals go one way only: a delay that all of them share cannot be told from an offset, and stays in the times.
struct ClockEstimate {
  double fast = 0;  ///< its seconds are shorter than ours by this share: 40e-6 gains 40 us a second
  double std_error = std::numeric_limits<double>::infinity();  ///< of `fast`; infinite: nothing is known yet
  double ahead = 0;  ///< [s] by which it has run ahead of ours since it is known, below 0 fallen behind
  double over = 0;   ///< [s] of arrivals that this rests on
};

}  // namespace emtb
