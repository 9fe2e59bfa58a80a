#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "analysis/discover/curves.h"
#include "analysis/discover/discover.h"
#include "config/formula_effect.h"
#include "tests/analysis/discover/on_bench.h"

namespace emtb {
namespace {

/// A friction that follows the speed late: a film that builds up. Each run has a copy of its own.
class LateFriction {
 public:
  static constexpr double size = 0.02, width = 120, tau = 0.3;  // [N m, rad/s, s]

  explicit LateFriction(double (*lasting)(double omega)) : lasting_(lasting) {}

  double operator()(double omega, double, double t) {
    if (t < t_) late_ = t_ = 0;
    late_ += (1 - std::exp(-(t - t_) / tau)) * (lasting_(omega) - late_);
    t_ = t;
    return late_;
  }

 private:
  double (*lasting_)(double omega);
  double t_ = 0, late_ = 0;
};

double saturating_friction(double omega) { return LateFriction::size * std::tanh(omega / LateFriction::width); }

/// Dry friction on something that gives before it slips.
class GivingFriction {
 public:
  static constexpr double size = 0.015, way = 10;  // [N m, rad]

  double operator()(double omega, double theta, double t) {
    if (t < t_) bent_ = theta_ = 0;
    bent_ = std::clamp(bent_ + (theta - theta_) / way, -1.0, 1.0);
    theta_ = theta;
    t_ = t;
    return omega == 0 ? 0 : size * bent_;
  }

 private:
  double t_ = 0, theta_ = 0, bent_ = 0;
};

double value_of(const Law& law, const std::string& symbol) {
  return std::ranges::find(law.parameters, symbol, &Parameter::symbol)->value;
}

TEST(DiscoverMemory, FindsAFrictionThatComesLate) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = LateFriction(saturating_friction);
  const Discovery d = discover_on(bench);
  ASSERT_TRUE(d.law);
  EXPECT_EQ(d.law->text.in_words(), "-a*z, dz/dt = (tanh(omega/w) - z)/tau");
  EXPECT_NEAR(value_of(*d.law, "tau"), LateFriction::tau, 0.03);
  EXPECT_NEAR(value_of(*d.law, "w"), LateFriction::width, 25);
  EXPECT_LT(d.law->held_out_after, 0.1 * d.law->held_out_before);
  ASSERT_TRUE(d.law->confirm_after);
  EXPECT_LT(*d.law->confirm_after, 0.3 * *d.law->confirm_before);
  for (std::size_t k = 0; k < d.law->at.size(); ++k) {
    const double lasting = -saturating_friction(d.law->at[k]);
    EXPECT_NEAR(d.law->value[k], lasting, 0.1 * LateFriction::size) << "its curve is what lasts, at " << d.law->at[k];
    EXPECT_GE(d.law->value_error[k], 0);
  }
}

TEST(DiscoverMemory, FindsAFrictionThatGivesBeforeItSlips) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = GivingFriction();
  const Discovery d = discover_on(bench);
  ASSERT_TRUE(d.law);
  EXPECT_THAT(d.law->text.id, testing::StartsWith("giving_friction"));
  EXPECT_NEAR(value_of(*d.law, "a"), GivingFriction::size, 0.1 * GivingFriction::size);
  EXPECT_LT(d.law->held_out_after, 0.2 * d.law->held_out_before);
}

TEST(DiscoverMemory, ACurveThatComesLateIsToldWhereAnotherRunConfirmsIt) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = LateFriction(friction_of_two_humps);
  const auto is_late_curve = [](const Discovery& d) {
    return d.law && d.law->text.is_curve && !d.law->text.rate.empty();
  };
  const Discovery confirmed = discover_on(bench);
  ASSERT_TRUE(is_late_curve(confirmed));
  EXPECT_NEAR(value_of(*confirmed.law, "tau"), LateFriction::tau, 0.05);
  EXPECT_LT(*confirmed.law->confirm_after, 0.8 * *confirmed.law->confirm_before);
  bench.held_out.erase(bench.held_out.begin() + 1, bench.held_out.end());
  EXPECT_FALSE(is_late_curve(discover_on(bench)));
}

TEST(DiscoverMemory, IsNotAskedForWhereAFormulaWithoutItIsAtTheFloor) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double, double) { return 0.01 * std::tanh(omega / 100); };
  const Discovery d = discover_on(bench);
  ASSERT_TRUE(d.law);
  EXPECT_TRUE(d.law->text.rate.empty()) << d.law->text.in_words();
}

constexpr double swing_lag = 0.2;  // [s]

/// Two runs that turn one way and the other by turns, a second each, from a second of rest; a torque follows late.
std::vector<MissingTorque> two_runs() {
  constexpr double speed = 50, torque = 0.01, step = 0.01;
  MissingTorque run;
  double z = 0;
  for (int k = 0; k < 800; ++k) {
    const int second = k / 100;
    const double way = second == 0 ? 0 : second % 2 == 1 ? 1 : -1;
    run.t.push_back(step * k);
    run.omega.push_back(speed * way);
    run.i_a.push_back(0.1 * std::cos(0.7 * k));
    run.theta.push_back(0);
    run.u_ref.push_back(1);
    run.acceleration.push_back(0);
    run.torque.push_back(-torque * z);
    run.voltage.push_back(0);
    z = way + (z - way) * std::exp(-step / swing_lag);
  }
  return {run, run};
}

Samples samples_along(std::span<const MissingTorque> runs) {
  WhatIsLeft left;
  left.runs.assign(runs.begin(), runs.end());
  Samples samples = samples_of(left, false);
  samples.paths = runs;
  return samples;
}

TEST(Grammar, EachSentenceThatRemembersIsReadAsACandidate) {
  const std::vector<MissingTorque> runs = two_runs();
  const Samples samples = samples_along(runs);
  for (const bool voltage : {false, true}) {
    const std::vector<FormulaText> all = remembering_sentences(samples, 1, 1, voltage);
    EXPECT_FALSE(all.empty());
    for (const FormulaText& text : all) {
      const AddedTerm term = read(text);
      EXPECT_LE(std::ranges::count(term.parameters, false, &Parameter::fixed), 3) << text.id;
      EXPECT_EQ(term.memory, "z");
      EXPECT_EQ(term.rate_formula, text.rate);
    }
  }
  for (const FormulaText& text : remembering_curves(samples, 1, 1, false)) {
    EXPECT_TRUE(text.is_curve);
    EXPECT_TRUE(read(text).rate) << text.id;
  }
}

TEST(Grammar, WithoutARunAsAWholeNothingCanBeRemembered) {
  EXPECT_THAT(remembering_sentences(Samples{}, 1, 1, false), testing::IsEmpty());
  EXPECT_THAT(remembering_curves(Samples{}, 1, 1, false), testing::IsEmpty());
}

TEST(Grammar, EquationErrorFollowsWhatIsRememberedAlongTheRuns) {
  const std::vector<MissingTorque> runs = two_runs();
  const Samples samples = samples_along(runs);
  const auto found = by_equation_error(samples, remembering_sentences(samples, 1, 1, false), read, 1);
  const auto late =
      std::ranges::find(found, "lagging_saturation_of_omega", [](const EquationError& e) { return e.law.id; });
  ASSERT_NE(late, found.end());
  EXPECT_GT(late->share, 0.95);
  EXPECT_NEAR(std::ranges::find(late->law.parameters, "tau", &FormulaText::Parameter::symbol)->value, swing_lag, 0.1)
      << "as near as a grid comes";

  const auto without = by_equation_error(samples, sentences(samples, 1, 1, false), read, 1);
  EXPECT_TRUE(without.empty() || without.front().share < 0.5) << "or it says nothing of memory";
}

TEST(Grammar, AMemoryAlongARunIsWhatTheRateMakesOfIt) {
  const std::vector<MissingTorque> runs = two_runs();
  const AddedTerm lag = read_formula(
      YamlMap::parse(
          "lag: {torque: -a*z, memory: {z: (omega/50 - z)/tau}, parameters: {a: {value: 0, min: -1, max: 1}, "
          "tau: {value: 0.2, min: 0.1, max: 1}}}",
          "a lag"),
      "lag");
  const std::vector<double> z = memory_along(lag, std::vector{1.0, swing_lag}, runs[0]);
  ASSERT_EQ(z.size(), runs[0].t.size());
  for (std::size_t k = 0; k < z.size(); ++k) EXPECT_NEAR(-0.01 * z[k], runs[0].torque[k], 1e-3) << runs[0].t[k] << " s";
}

}  // namespace
}  // namespace emtb
