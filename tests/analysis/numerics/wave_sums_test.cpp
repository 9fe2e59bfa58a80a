#include "analysis/numerics/wave_sums.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace emtb {
namespace {

/// As the library's sine has it.
WaveSums by_the_book(const std::vector<double>& angle, const std::vector<double>& value, double per_turn) {
  WaveSums w;
  for (std::size_t k = 0; k < angle.size(); ++k) {
    const double s = std::sin(per_turn * angle[k]), c = std::cos(per_turn * angle[k]);
    w.sine += s, w.cosine += c;
    w.sine_sine += s * s, w.sine_cosine += s * c, w.cosine_cosine += c * c;
    w.value += value[k], w.sine_value += s * value[k], w.cosine_value += c * value[k];
  }
  return w;
}

void expect_near(const WaveSums& a, const WaveSums& b, double tolerance) {
  EXPECT_NEAR(a.sine, b.sine, tolerance);
  EXPECT_NEAR(a.cosine, b.cosine, tolerance);
  EXPECT_NEAR(a.sine_sine, b.sine_sine, tolerance);
  EXPECT_NEAR(a.sine_cosine, b.sine_cosine, tolerance);
  EXPECT_NEAR(a.cosine_cosine, b.cosine_cosine, tolerance);
  EXPECT_NEAR(a.value, b.value, tolerance);
  EXPECT_NEAR(a.sine_value, b.sine_value, tolerance);
  EXPECT_NEAR(a.cosine_value, b.cosine_value, tolerance);
}

TEST(WaveSums, AreThoseOfTheLibrarysSine) {
  for (const double reach : {1e-3, 1.0, 1e3, 1e6, 3e7, 1e10, 1e17}) {  // [rad] with any sign; the last are far
    std::vector<double> angle, value;
    for (int k = 0; k < 1003; ++k) {
      angle.push_back(reach * std::sin(1.7 * k) * std::cos(0.03 * k));
      value.push_back(std::cos(0.9 * k));
    }
    for (const double per_turn : {0.5, 1.0, 2.71}) {
      expect_near(wave_sums(angle, value, per_turn), by_the_book(angle, value, per_turn), 1e-11);
      expect_near(wave_sums_for<Processor::any>(angle, value, per_turn), by_the_book(angle, value, per_turn), 1e-11);
    }
  }
}

TEST(WaveSums, EveryQuarterOfATurnIsRight) {
  for (int quarter = -9; quarter <= 9; ++quarter) {
    for (const double beside : {-0.785, -1e-9, 0.0, 1e-9, 0.785}) {
      const double x = quarter * std::acos(0.0) + beside;
      const WaveSums w = wave_sums(std::vector<double>(4, x), std::vector<double>(4, 1.0), 1);
      EXPECT_NEAR(w.sine, 4 * std::sin(x), 1e-14);
      EXPECT_NEAR(w.cosine, 4 * std::cos(x), 1e-14);
    }
  }
}

}  // namespace
}  // namespace emtb
