#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "analysis/numerics/lag_sums.h"

namespace emtb {

/// What the instruments read of a motor that stands, less what the model says: nothing but what they themselves add.
class RestReadings {
 public:
  explicit RestReadings(std::size_t outputs) : sums_(outputs) {}

  void see(std::size_t output, double residual) {
    sums_[output].sum += residual;
    sums_[output].n += 1;
  }

  /// Would an instrument that adds so much have read otherwise at rest?
  /// @param std_error of the value @param clear standard errors
  bool contradict(std::size_t output, double value, double std_error, const NoiseColour& colour, double clear) const {
    const Sum& at_rest = sums_[output];
    if (at_rest.n < fewest) return false;
    const double coloured = (1 + colour.rho) / (1 - colour.rho);
    const double of_mean = colour.sigma * std::sqrt(std::max(1.0, coloured) / at_rest.n);
    return std::abs(at_rest.sum / at_rest.n - value) > clear * std::hypot(std_error, of_mean);
  }

 private:
  static constexpr double fewest = 5;  ///< blocks; by hand
  struct Sum {
    double sum = 0, n = 0;
  };
  std::vector<Sum> sums_;  ///< by output
};

}  // namespace emtb
