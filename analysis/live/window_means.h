#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/live/simulated_motor.h"

namespace emtb {

/// What slow meters should have read: means of the simulated motor over windows that end now or a little before, by the
/// integrals over time, which are kept for as long as the longest window.
class WindowMeans {
 public:
  /// @param plan is kept
  explicit WindowMeans(const LivePlan& plan);

  /// No window reaches back beyond the next tick.
  void interrupt() { stored_ = 0; }

  /// The motor is at the next tick.
  void add(const SimulatedMotor& motor);

  /// @param derivatives takes those of the mean by all that moves, at its head
  /// @return SI; absent where the window is not within what was seen
  std::optional<double> mean(const SlowReading& reading, Eigen::VectorXd& derivatives) const;

 private:
  struct Entry {
    double t = 0;
    std::vector<double> value;  ///< for each slow output: integral and value, then those of its derivatives
  };

  std::size_t entry_at(double t) const;

  const LivePlan& plan_;
  std::vector<std::size_t> first_;  ///< for each output: where its values begin in an entry
  std::vector<Entry> ring_;         ///< empty: no meter is slow
  std::size_t newest_ = 0, stored_ = 0;
};

}  // namespace emtb
