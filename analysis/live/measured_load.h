#pragma once

#include <array>
#include <cstddef>
#include <limits>

#include "analysis/live/steady_mean.h"

namespace emtb {

/// The load of the shaft by a torque gauge's readings, where they are more than its noise.
class MeasuredLoad {
 public:
  /// @param lsb [N m] of the gauge. @param settling [s] of the motor. @param period [s] of the readings
  MeasuredLoad(double lsb, double settling, double period) : lsb_(lsb), settling_(settling), period_(period) {}

  /// A run begins at t [s]. What has loaded the shaft before does so as it starts, below the noise at first.
  void start_run(double t);

  /// The reference changes at t [s]. The speed follows it, and a load the speed, long before noise lets it be seen.
  void expect_change(double t);

  /// @param t [s] of the tick. @param torque [N m], NaN: not read. @return [N m], 0 where nothing but noise is seen
  double next(double t, double torque);

  /// [N m] of a reading.
  double noise() const;

 private:
  static constexpr std::size_t readings = 32;  ///< whose mean tells a load from noise; by hand

  double lsb_, settling_, period_;
  std::array<double, readings> last_{};
  std::size_t count_ = 0;
  double sum_ = 0, before_ = 0, changes_ = 0;
  double loaded_until_ = -std::numeric_limits<double>::infinity();  ///< [s] by the noise of the gauge; never yet
  SteadyMean steady_;
};

}  // namespace emtb
