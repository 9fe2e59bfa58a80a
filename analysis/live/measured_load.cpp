#include "analysis/live/measured_load.h"

#include <algorithm>
#include <cmath>

namespace emtb {

void MeasuredLoad::start_run(double t) {
  if (std::isfinite(loaded_until_)) loaded_until_ = t + settling_;
}

void MeasuredLoad::expect_change(double t) {
  steady_.expect_change(static_cast<int>(settling_ / period_));
  if (std::isfinite(loaded_until_)) loaded_until_ = std::max(loaded_until_, t + settling_);
}

double MeasuredLoad::next(double t, double torque) {
  if (!std::isfinite(torque)) return 0;
  double& oldest = last_[count_ % readings];
  sum_ += torque - oldest;
  oldest = torque;
  const double change = torque - before_;
  before_ = torque;
  if (++count_ < readings) return 0;
  changes_ += (change * change - changes_) / static_cast<double>(std::min<std::size_t>(count_, 2000));
  if (count_ % readings == 0) {  // no rounding piles up
    sum_ = 0;
    for (const double x : last_) sum_ += x;
  }
  const double mean = std::abs(sum_) / readings;
  const double limit = 6 * std::sqrt(0.5 * changes_ / readings) + 2 * lsb_;  // standard errors, digits: by hand
  if (mean > limit) loaded_until_ = t + 1;
  const double steady = steady_.next(torque);
  return t < loaded_until_ ? steady : 0;
}

double MeasuredLoad::noise() const { return std::sqrt(0.5 * changes_); }

}  // namespace emtb
