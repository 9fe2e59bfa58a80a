#include "analysis/numerics/ringing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using ManySeries = std::vector<std::vector<double>>;

/// Steps that ring and settle slowly besides, each second, in noise.
std::vector<double> steps_that_ring(double frequency, double amplitude, unsigned seed) {
  std::vector<double> x = synthetic::coloured(6000, 0.7, seed);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const double t = std::fmod(1e-3 * static_cast<double>(k), 1.0);  // [s] since the last step
    x[k] = 0.3 * x[k] + amplitude * std::exp(-6 * t) * std::sin(2 * std::numbers::pi * frequency * t) +
           2 * std::exp(-4 * t);
  }
  return x;
}

TEST(Ringing, IsToldToATenthWhateverElseSettles) {
  for (const double frequency : {5.0, 20.0, 34.0, 90.0}) {
    const ManySeries runs{steps_that_ring(frequency, 2, 1), steps_that_ring(frequency, 3, 2)};
    EXPECT_NEAR(ringing_frequency(runs, 1e-3) / (2 * std::numbers::pi), frequency, 0.1 * frequency);
  }
}

TEST(Ringing, IsNotHeardInNoiseOrInWhatOnlySettles) {
  EXPECT_EQ(ringing_frequency(ManySeries{steps_that_ring(20, 0, 3), steps_that_ring(20, 0, 4)}, 1e-3), 0);
  EXPECT_EQ(ringing_frequency(ManySeries{synthetic::coloured(6000, 0.9, 5)}, 1e-3), 0);
}

TEST(Ringing, NeedsAHundredReadings) {
  EXPECT_EQ(ringing_frequency(ManySeries{std::vector<double>(99, 1.0)}, 1e-3), 0);
  EXPECT_EQ(ringing_frequency({}, 1e-3), 0);
}

}  // namespace
}  // namespace emtb
