#pragma once

#include <span>
#include <string>
#include <vector>

#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// A parameter of one session, or of one run.
struct TrendPoint {
  std::string run;
  double value = 0, std_error = 0;
  double line = 0, line_error = 0;  ///< the straight line here
};

/// A parameter over sessions, and the straight line through it.
struct Trend {
  std::string parameter, unit;
  std::vector<TrendPoint> points;
  double slope = 0, slope_error = 0;  ///< from one point to the next; the error counts the scatter between points
  double whole = 0;                   ///< of the line's middle, from the first point to the last
  bool clear = false;  ///< slope beyond as many of its errors as are as rare as three of a normal, and 3 % in all
};

/// Each free parameter fitted to each group of records by itself, what the groups cannot tell alone held at the value
/// of all. @param names one a group @throws ModelError where a group cannot be simulated.
std::vector<Trend> trends(std::span<const std::vector<Record>> groups, const std::vector<std::string>& names,
                          const Model& fitted);

}  // namespace emtb
