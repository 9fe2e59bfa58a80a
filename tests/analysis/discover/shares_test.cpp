#include "analysis/discover/shares.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/analysis/discover/on_bench.h"

namespace emtb {
namespace {

/// Four runs of speeds and currents that go their own ways, with a torque that both make.
WhatIsLeft left_of(const std::function<double(double omega, double i_a)>& torque) {
  WhatIsLeft left;
  for (int r = 0; r < 4; ++r) {
    MissingTorque run;
    for (int k = 0; k < 700; ++k) {
      const double x = 0.02 * k + r;
      run.t.push_back(0.01 * k);
      run.omega.push_back(100 * std::sin(x) + 20 * std::cos(3.7 * x));
      run.i_a.push_back(2 * std::sin(2.3 * x + 0.4) + 0.3 * std::sin(7 * x));
      run.theta.push_back(0.9 * k * x);
      run.u_ref.push_back(std::sin(5.1 * x));
      run.acceleration.push_back(std::cos(6.1 * x));
      run.torque.push_back(torque(run.omega.back(), run.i_a.back()));
      run.voltage.push_back(0);
    }
    left.runs.push_back(run);
  }
  left.torque_scale = 1;
  return left;
}

double friction_by_both(double omega, double i_a) {
  return -0.01 * std::tanh(omega) * std::sqrt(std::abs(omega) / 100) * std::abs(i_a) / 2;
}

TEST(Shares, TellWhatTwoQuantitiesExplainOnlyTogether) {
  const Shares shares = shares_of(left_of(friction_by_both), false);
  ASSERT_TRUE(shares.of.contains("omega and i_a"));
  const Share& both = shares.of.at("omega and i_a");
  EXPECT_GT(both.alone, 0.85);
  EXPECT_GT(both.only, 0.1);
  EXPECT_LT(shares.of.at("omega").alone + both.only, both.alone + 0.01) << "beyond a curve of either";
  EXPECT_GE(shares.ceiling, both.alone);
  EXPECT_FALSE(shares.of.contains("omega and t"));
}

TEST(Shares, AreSilentOfTwoQuantitiesThatACurveOfEachTells) {
  const Shares shares = shares_of(
      left_of([](double omega, double i_a) { return 0.01 * std::sin(omega / 30) + 0.002 * i_a * i_a; }), false);
  EXPECT_GT(shares.together, 0.9);
  for (const auto& [name, share] : shares.of) EXPECT_THAT(name, testing::Not(testing::HasSubstr(" and ")));
}

TEST(Grammar, HasASentenceOfSpeedAndCurrentTogether) {
  const WhatIsLeft left = left_of(friction_by_both);
  const Samples samples = samples_of(left, false);
  const auto found = by_equation_error(samples, sentences(samples, 1, 1, false), read, 1);
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found.front().law.id, "friction_of_speed_and_current");
  EXPECT_GT(found.front().share, 0.95);
  const auto value = [&](const char* symbol) {
    return std::ranges::find(found.front().law.parameters, symbol, &FormulaText::Parameter::symbol)->value;
  };
  EXPECT_NEAR(value("n"), 0.5, 0.25) << "as near as a grid comes";
  EXPECT_NEAR(value("m"), 1, 0.4);
}

}  // namespace
}  // namespace emtb
