#include "analysis/discover/law_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/blind/recording.h"

namespace emtb {
namespace {

/// A law over speeds up to 450 rad/s that is not sure at some places.
Law unsure_at(const std::string& over, std::vector<double> places) {
  Law law;
  law.text.formula = "-a*tanh(omega/s)";
  law.text.of = {over};
  law.at = {-450, 450};
  law.most_uncertain_at = std::move(places);
  law.model = blind::fast_bench().model;
  return law;
}

constexpr double hold = 1;  // [s]

std::vector<double> levels_of(const Profile& profile) {
  std::vector<double> levels;
  for (double t = 0.5 * hold + 0.5 * hold; t < profile.duration() - 0.5 * hold; t += hold) {
    levels.push_back(profile.reference(t));
  }
  return levels;
}

TEST(LawExperiment, HoldsTheSpeedsAtWhichTheLawIsLeastSure) {
  const Law law = unsure_at("omega", {-300, 180});
  const auto e = law_experiment(law, {.low = -5, .high = 5}, hold);
  ASSERT_TRUE(e);
  EXPECT_EQ(e->over, "omega");
  EXPECT_THAT(e->at, testing::ElementsAre(-300, 180));
  const auto y = foresee(law.model, e->fit, 1e-3);
  ASSERT_TRUE(y);
  std::vector<double> speeds;
  for (double t = 1.4 * hold; t < e->fit.duration() - 0.5 * hold; t += hold) {
    speeds.push_back(y->readings.omega[static_cast<std::size_t>(t / 1e-3)]);
  }
  ASSERT_EQ(speeds.size(), 6U);
  const std::vector<double> wanted{-318, -300, -282, 162, 180, 198};
  for (std::size_t k = 0; k < wanted.size(); ++k) EXPECT_NEAR(speeds[k], wanted[k], 4);

  std::vector<double> back = levels_of(e->judge);
  std::ranges::reverse(back);
  EXPECT_EQ(back, levels_of(e->fit)) << "to judge by: the other way round";
}

TEST(LawExperiment, LeavesOutWhatTheBenchDoesNotReach) {
  const auto e = law_experiment(unsure_at("omega", {-300, 180}), {.low = 0, .high = 5}, hold);
  ASSERT_TRUE(e);
  EXPECT_THAT(e->at, testing::ElementsAre(180));
  EXPECT_GE(e->fit.min(), 0);
  EXPECT_FALSE(law_experiment(unsure_at("omega", {-300}), {.low = 0, .high = 5}, hold));
}

TEST(LawExperiment, OfALawOfTheReferenceHoldsThatItself) {
  Law law = unsure_at("u_ref", {2});
  law.at = {-5, 5};
  const auto e = law_experiment(law, {.low = -5, .high = 5}, hold);
  ASSERT_TRUE(e);
  EXPECT_THAT(levels_of(e->fit), testing::Pointwise(testing::DoubleNear(1e-9), {1.8, 2.0, 2.2}));
}

TEST(LawExperiment, KeepsAwayFromTheLimitsOfTheBench) {
  const auto free = law_experiment(unsure_at("omega", {400}), {.low = -5, .high = 5}, hold),
             limited = law_experiment(unsure_at("omega", {400}),
                                      {.low = -5, .high = 5, .limits = {{Signal::omega, 300}}}, hold);
  ASSERT_TRUE(free);
  ASSERT_TRUE(limited);
  EXPECT_LT(limited->fit.max(), 0.7 * free->fit.max());
}

TEST(LawExperiment, ThereIsNoneForALawOfTheAngleOrTheTime) {
  for (const char* over : {"theta", "t"}) {
    EXPECT_FALSE(law_experiment(unsure_at(over, {1}), {.low = -5, .high = 5}, hold)) << over;
  }
  EXPECT_FALSE(law_experiment(unsure_at("omega", {}), {.low = -5, .high = 5}, hold)) << "sure everywhere";
}

}  // namespace
}  // namespace emtb
