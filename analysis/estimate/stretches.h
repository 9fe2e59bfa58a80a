#pragma once

#include <span>
#include <vector>

#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// The settled points that have all of these signals, with the armature closed. The others are noted in
/// `result.left_out` with what they lack.
std::vector<const SettledPoint*> points_with(const Settled& settled, std::span<const Signal> signals,
                                             StaticEstimate& result);

/// The stretches of a run in which `armature_open` is 1.
std::vector<Stretch> open_armature(const Run& run);

/// The instrument's step, as the session states it or as the readings show it; 0: neither.
double lsb_of(const Series& series);

/// A least-squares line through the readings of a stretch: value at its middle, slope, and their standard errors.
struct LocalLine {
  double value = 0, value_error = 0;
  double slope = 0, slope_error = 0;
  std::size_t readings = 0;
};
LocalLine local_line(const Series& series, double from, double to);

}  // namespace emtb
