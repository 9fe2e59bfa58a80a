#include "analysis/diagnose/missing_curve.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/compare.h"
#include "analysis/fit/calibrate.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using testing::IsEmpty;
using testing::Not;

/// The curve of one quantity that the fitted linear model lacks of a bench's training runs.
MissingCurve curve(const blind::Bench& bench, const std::string& quantity) {
  const Dataset data = prepare(record(bench, bench.train, 3), {}, bench.model);
  const Model fitted = calibrate(data.train, bench.model).model;
  for (const MissingCurve& c : missing_curves(data.train, fitted)) {
    if (c.quantity == quantity) return c;
  }
  return {};
}

TEST(MissingCurve, DrawsAFrictionThatNoLibraryHas) {
  blind::Bench bench = blind::fast_bench();
  const auto bump = [](double omega) {
    return std::copysign(0.01 * std::exp(-std::pow((std::abs(omega) - 250) / 40, 2)), omega);
  };
  bench.plant.hidden_torque = [bump](double omega, double, double) { return bump(omega); };
  const MissingCurve c = curve(bench, "torque");
  ASSERT_THAT(c.x, Not(IsEmpty()));
  EXPECT_EQ(c.against, "omega");
  const auto deepest = std::ranges::min_element(c.value) - c.value.begin();
  const auto highest = std::ranges::max_element(c.value) - c.value.begin();
  EXPECT_NEAR(c.x[static_cast<std::size_t>(deepest)], 250, 40);
  EXPECT_NEAR(c.x[static_cast<std::size_t>(highest)], -250, 40);
  for (std::size_t i = 0; i < c.x.size(); ++i) {
    // B has taken up a little of it; between two knots the bump is not straight.
    EXPECT_NEAR(c.value[i], -bump(c.x[i]), 0.0035 + 2 * c.std_error[i]) << c.x[i];
  }
}

TEST(MissingCurve, OfDryFrictionJumpsAtStandstill) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.friction.T_c = 0.05;
  const MissingCurve c = curve(bench, "torque");
  ASSERT_GE(c.x.size(), 8U);
  // What a linear model lacks of it: a constant less the B that it has grown instead. A straight line through the
  // knots.
  const std::size_t a = 2, b = c.x.size() - 1;
  const double slope = (c.value[b] - c.value[a]) / (c.x[b] - c.x[a]);
  EXPECT_NEAR(c.value[a] - slope * c.x[a], -0.05, 0.005);
  EXPECT_GT(slope, 0);
}

TEST(MissingCurve, IsZeroWithinItsBandWhereNothingIsMissing) {
  for (const blind::Bench& bench : {blind::slow_bench(), blind::fast_bench()}) {
    for (const char* quantity : {"torque", "voltage"}) {
      const MissingCurve c = curve(bench, quantity);
      ASSERT_THAT(c.x, Not(IsEmpty()));
      std::size_t outside = 0;
      for (std::size_t i = 0; i < c.x.size(); ++i) outside += std::abs(c.value[i]) > 3 * c.std_error[i] ? 1 : 0;
      EXPECT_LE(outside, 1 + c.x.size() / 10) << quantity;
    }
  }
}

TEST(MissingCurve, OfAVoltageIsThatOfTheBrushes) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.motor.brush_drop = 0.4;
  const MissingCurve c = curve(bench, "voltage");
  ASSERT_THAT(c.x, Not(IsEmpty()));
  EXPECT_EQ(c.against, "i_a");
  // Its sign is against the current, at currents where the fitted R_a is not far off.
  double low = 0, high = 0;
  for (std::size_t i = 0; i < c.x.size(); ++i) {
    if (c.x[i] > 0.2 && c.x[i] < 3) high = std::min(high, c.value[i]);
    if (c.x[i] < -0.2 && c.x[i] > -3) low = std::max(low, c.value[i]);
  }
  EXPECT_LT(high, -0.02);
  EXPECT_GT(low, 0.02);
}

}  // namespace
}  // namespace emtb
