#include "analysis/fit/profile_likelihood.h"

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/record/dataset.h"
#include "model/catalogue.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::record;
using synthetic::servo_model;

constexpr synthetic::Sigma instruments{.omega = 0.1, .i_a = 0.01, .e_a = 0.02};
constexpr double allowed = 0.5 * 3.841;  // rise of half the sum of squares: chi-square, one degree of freedom, 95 %

Model guess() {
  Model model = servo_model();
  model.noise = {{Signal::omega, instruments.omega}, {Signal::i_a, instruments.i_a}, {Signal::e_a, instruments.e_a}};
  return model;
}

std::vector<Record> recorded(const Model& model, unsigned seed = 1) {
  const std::vector<Record> records =
      prepare(std::vector{record({}, synthetic::steps, 1e-3, instruments, seed)}, {}, model).train;
  return records;
}

/// How much more the best fit costs once a parameter is held at a value.
double rise_at(const std::vector<Record>& records, const Calibration& fitted, std::size_t place, double value) {
  Model held = fitted.model;
  held.at(place).value = value;
  held.at(place).fixed = true;
  return calibrate(records, held).cost - fitted.cost;
}

TEST(ProfileLikelihood, IsTheStandardErrorsWhereTheModelIsNearlyLinear) {
  const Model model = guess();
  const auto records = recorded(model);
  const Calibration c = calibrate(records, model);
  for (const std::size_t place : {0U, 1U, 4U}) {
    const Parameter& p = c.model.at(place);
    const auto interval = profile_likelihood(records, c, place);
    ASSERT_TRUE(interval) << p.symbol;
    EXPECT_NEAR(interval->low, p.value - 1.96 * *p.std_error, 0.15 * *p.std_error) << p.symbol;
    EXPECT_NEAR(interval->high, p.value + 1.96 * *p.std_error, 0.15 * *p.std_error) << p.symbol;
    EXPECT_FALSE(interval->low_at_bound || interval->high_at_bound);
    EXPECT_FALSE(misled(p, *interval)) << p.symbol;
  }
}

TEST(ProfileLikelihood, EndsWhereTheCostHasRisenAsFarAsTheDataAllow) {
  const Model model = guess();
  const auto records = recorded(model);
  const Calibration c = calibrate(records, model);
  const auto interval = profile_likelihood(records, c, 0);
  ASSERT_TRUE(interval);
  EXPECT_NEAR(rise_at(records, c, 0, interval->low), allowed * c.inflation[0], 0.1 * allowed * c.inflation[0]);
  EXPECT_NEAR(rise_at(records, c, 0, interval->high), allowed * c.inflation[0], 0.1 * allowed * c.inflation[0]);
}

TEST(ProfileLikelihood, SaysHowLargeAnEffectMayBeThatRestsOnItsNull) {
  Model model = guess();
  model.include(effect_index("windage"));
  constexpr std::size_t windage = ModelStructure::base_count;
  for (unsigned seed = 1; seed < 20; ++seed) {
    const auto records = recorded(model, seed);
    const Calibration c = calibrate(records, model);
    if (c.at_bound != std::vector<std::string>{"windage.c_w"}) continue;
    ASSERT_FALSE(c.model.at(windage).std_error) << "of which a standard error says nothing";
    const auto interval = profile_likelihood(records, c, windage);
    ASSERT_TRUE(interval);
    EXPECT_EQ(interval->low, 0);
    EXPECT_TRUE(interval->low_at_bound);
    EXPECT_FALSE(interval->high_at_bound);
    EXPECT_GT(interval->high, 0);
    const auto i = static_cast<Eigen::Index>(c.inflation.size() - 1);
    EXPECT_NEAR(rise_at(records, c, windage, interval->high) / c.inflation[i], allowed, 0.1 * allowed);
    EXPECT_TRUE(misled(c.model.at(windage), *interval));
    return;
  }
  FAIL() << "in none of twenty recordings does it rest there";
}

TEST(ProfileLikelihood, EndsAtTheBoundOfAParameterThatTheDataLeaveOpen) {
  Model model = guess();
  model.at(0).min = 1.19;  // what a data sheet allows is narrower than what these data tell
  model.at(0).max = 1.21;
  model.noise = {{Signal::omega, 1}, {Signal::i_a, 0.1}, {Signal::e_a, 0.2}};
  const std::vector<Record> records =
      prepare(std::vector{record({}, {{0.05, 0}, {0.05, 0.2}}, 1e-3, {.omega = 1, .i_a = 0.1, .e_a = 0.2})}, {}, model)
          .train;
  const Calibration c = calibrate(records, model);
  const auto interval = profile_likelihood(records, c, 0);
  ASSERT_TRUE(interval);
  EXPECT_TRUE(interval->low_at_bound && interval->high_at_bound);
  EXPECT_EQ(interval->low, 1.19);
  EXPECT_EQ(interval->high, 1.21);
}

TEST(ProfileLikelihood, AllThatAFitMovesHaveOneAndNothingElse) {
  Model model = guess();
  model.at(3).fixed = true;
  const auto records = recorded(model);
  const LikelihoodIntervals all = profile_likelihoods(records, calibrate(records, model));
  std::vector<std::string> names;
  for (const auto& [name, interval] : all) names.push_back(name);
  EXPECT_EQ(names, (std::vector<std::string>{"J", "K_b", "R_a"})) << "K_m follows K_b, B is fixed";
}

}  // namespace
}  // namespace emtb
