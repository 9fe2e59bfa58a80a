#include "analysis/diagnose/foresee.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "hal/error.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

double peak(const Model& model, const Profile& profile, Signal signal) {
  const auto run = foresee(model, profile, 1e-3);  // kept while its readings are looked at
  double most = 0;
  for (const double v : run->readings.of(signal)) most = std::max(most, std::abs(v));
  return most;
}

/// From one end to the other: the current of a start, twice.
Profile reversal() {
  const std::array levels{5.0, -5.0};
  return staircase("reversal", levels, 0.1, 1, 1);
}

TEST(Foresee, SimulatesTheWholeProfileFromStandstill) {
  const Model model = blind::fast_bench().model;
  const auto run = foresee(model, step("s", 2, 0.5, 2, 0.5), 1e-3);
  ASSERT_TRUE(run);
  EXPECT_EQ(run->excitation.t.size(), 3001U);
  EXPECT_EQ(run->readings.omega.front(), 0);
  EXPECT_EQ(run->readings.omega[400], 0);
  EXPECT_GT(run->readings.omega[2400], 100);
}

TEST(Foresee, RefusesAModelThatNoProfileDrives) {
  Model model = blind::fast_bench().model;
  model.input = Signal::i_a;
  EXPECT_THROW(foresee(model, reversal(), 1e-3), ModelError);
}

TEST(WithinLimits, LeavesAProfileAloneThatKeepsAway) {
  const Model model = blind::fast_bench().model;
  const double current = peak(model, reversal(), Signal::i_a);
  const auto kept = within_limits(reversal(), model, {{Signal::i_a, 1.5 * current}});
  ASSERT_TRUE(kept);
  EXPECT_EQ(kept->max(), 5);
  EXPECT_EQ(within_limits(reversal(), model, {})->max(), 5);
}

TEST(WithinLimits, MakesTheLevelsSmallerWhereTheCurrentWouldEndTheRun) {
  const Model model = blind::fast_bench().model;
  const double limit = 0.6 * peak(model, reversal(), Signal::i_a);
  const auto smaller = within_limits(reversal(), model, {{Signal::i_a, limit}});
  ASSERT_TRUE(smaller);
  EXPECT_LT(smaller->max(), 5);
  EXPECT_GT(smaller->max(), 1);
  EXPECT_DOUBLE_EQ(smaller->min(), -smaller->max()) << "the same shape";
  EXPECT_EQ(smaller->duration(), reversal().duration());
  EXPECT_LE(peak(model, *smaller, Signal::i_a), 0.8 * limit);
  EXPECT_GE(peak(model, *smaller, Signal::i_a), 0.6 * limit) << "no smaller than it must be";
}

TEST(WithinLimits, GivesUpWhereNothingIsLeftOfTheExperiment) {
  const Model model = blind::fast_bench().model;
  EXPECT_FALSE(within_limits(reversal(), model, {{Signal::omega, 1.0}}));
}

}  // namespace
}  // namespace emtb
