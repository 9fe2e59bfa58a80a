#include "analysis/live/noise_floor.h"

#include <algorithm>
#include <cmath>

namespace emtb {

void DifferenceFloor::add(double r) {
  if (seen_ >= 1) {
    first_ += (r - before_) * (r - before_);
    ++firsts_;
  }
  if (seen_ >= 2) {
    second_ += (r - before_that_) * (r - before_that_);
    ++seconds_;
  }
  before_that_ = before_;
  before_ = r;
  seen_ = std::min(seen_ + 1, 2);
}

NoiseColour DifferenceFloor::colour() const {
  constexpr double fewest = 20;    // differences that tell a colour; by hand
  constexpr double longest = 0.7;  // rho; beyond that it is an error of the model that lasts; by hand
  if (firsts_ < 1 || first_ <= 0) return {.sigma = 0, .rho = 0};
  const double first = first_ / firsts_;
  const double rho = seconds_ < fewest ? 0 : std::clamp(second_ / seconds_ / first - 1, -0.5, longest);
  const double doubt = 1 + fewest / firsts_;  // the first few may all be small
  return {.sigma = std::sqrt(0.5 * first / (1 - rho) * doubt), .rho = rho};
}

void MeterFloor::add(double value) {
  if (count_ > 0) changes_[(count_ - 1) % changes_.size()] = std::abs(value - before_);
  before_ = value;
  ++count_;
}

double MeterFloor::sigma() const {
  auto sorted = changes_;
  const std::size_t n = std::min(count_ > 0 ? count_ - 1 : 0, sorted.size());
  if (n == 0) return 0;
  std::nth_element(sorted.begin(), sorted.begin() + n / 2, sorted.begin() + n);
  return 1.4826 / std::sqrt(2.0) * sorted[n / 2];  // of the normal distribution: sigma by the median of a change
}

}  // namespace emtb
