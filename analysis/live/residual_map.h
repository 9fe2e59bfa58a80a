#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "analysis/live/change.h"
#include "analysis/live/plan.h"

namespace emtb {

/// RMS of residuals over speed or current, in bins over a range that grows as it must. What is old fades.
class LiveResidualMap {
 public:
  /// @param against omega or i_a
  LiveResidualMap(Signal against, std::size_t outputs);

  /// @param x SI, the speed or the current. @param normalised residual in units of the noise floor
  void add(double x, std::size_t output, double normalised);

  /// The bins in which enough has been seen.
  std::vector<LiveBin> bins(const LivePlan& plan) const;

 private:
  static constexpr std::size_t count = 16;  ///< bins
  struct Cell {
    double squares = 0, weight = 0;
  };

  void widen();

  Signal against_;
  double reach_ = 0;                            ///< SI: from -reach to reach
  std::array<std::vector<Cell>, count> cells_;  ///< by output
};

}  // namespace emtb
