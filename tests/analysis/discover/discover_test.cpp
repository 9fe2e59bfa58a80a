#include "analysis/discover/discover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "analysis/discover/curves.h"
#include "tests/analysis/discover/on_bench.h"
#include "tests/blind/curve_error.h"

namespace emtb {
namespace {

/// A bump of friction at one speed: the library has nothing like it.
blind::Bench bench_with_a_bump() {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double, double) {
    return std::copysign(0.01 * std::exp(-std::pow((std::abs(omega) - 250) / 40, 2)), omega);
  };
  return bench;
}

TEST(Discover, FindsALawOfTheSpeedThatTheLibraryLacks) {
  const Discovery d = discover_on(bench_with_a_bump());
  EXPECT_TRUE(d.worth_a_name);
  EXPECT_GT(d.torque.of.at("omega").alone, 0.15);
  EXPECT_LT(d.torque.of.at("theta").alone, 0.05);
  ASSERT_TRUE(d.law);
  EXPECT_EQ(d.law->text.of.front(), "omega");
  EXPECT_LT(d.law->held_out_after, 0.4 * d.law->held_out_before);
  ASSERT_TRUE(d.law->confirm_after);
  EXPECT_LT(*d.law->confirm_after, *d.law->confirm_before);
  for (std::size_t k = 0; k < d.law->at.size(); ++k) {
    const double omega = d.law->at[k];
    const double truth = -std::copysign(0.01 * std::exp(-std::pow((std::abs(omega) - 250) / 40, 2)), omega);
    EXPECT_NEAR(d.law->value[k], truth, 2e-3) << omega;
  }
}

TEST(Discover, TellsTheCurveWhereNoShortFormulaFollowsIt) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double, double) { return friction_of_two_humps(omega); };
  const Discovery d = discover_on(bench);
  ASSERT_TRUE(d.law);
  EXPECT_TRUE(d.law->text.is_curve);
  EXPECT_EQ(d.law->text.of.front(), "omega");
  EXPECT_LT(d.law->held_out_after, 0.3 * d.law->held_out_before);
  EXPECT_LT(blind::curve_error(
                *d.law, "omega", [](double omega) { return -friction_of_two_humps(omega); }, true),
            0.1);
  EXPECT_TRUE(!d.law->nearest || d.law->nearest_held_out > d.law->held_out_after);
  const AddedTerm again = read(d.law->text);
  EXPECT_EQ(again.parameters.size(), d.law->parameters.size()) << "it is a candidate like any other";
}

/// A friction that the base parameters of a model without it bend to, until what they leave is no function of the
/// speed.
double friction_that_bends_the_base(double omega) {
  constexpr std::array at_every_75{0.0, 0.02, 0.017, 0.001, 0.019, 0.007, 0.023, 0.023};  // rad/s; [N m]
  const double at = std::min(std::abs(omega) / 75, 6.9);
  const auto k = static_cast<std::size_t>(at);
  return std::copysign(std::lerp(at_every_75[k], at_every_75[k + 1], at - static_cast<double>(k)), omega);
}

TEST(Discover, TellsACurveThatTheBaseParametersHaveBentTo) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double, double) { return friction_that_bends_the_base(omega); };
  const Discovery d = discover_on(bench);
  EXPECT_LT(d.torque.of.at("omega").alone, 0.2) << "or it says nothing of such a case";
  ASSERT_TRUE(d.law);
  EXPECT_TRUE(d.law->text.is_curve);
  EXPECT_LT(d.law->held_out_after, 0.2 * d.law->held_out_before);
  EXPECT_LT(blind::curve_error(
                *d.law, "omega", [](double omega) { return -friction_that_bends_the_base(omega); }, true),
            0.1);
}

TEST(Discover, FindsAFrictionThatIsNotAlikeAroundTheTurn) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double theta, double) {
    return 0.12 * std::tanh(omega) * std::cos(theta);
  };
  bench.channels.push_back({.signal = Signal::theta, .low = -6283, .high = 6283, .bits = 23, .noise = 0});
  const Discovery d = discover_on(bench);
  EXPECT_GT(d.torque.of.at("theta_against_motion").alone, 0.3);
  EXPECT_LT(d.torque.of.at("theta").alone, 0.5 * d.torque.of.at("theta_against_motion").alone);
  ASSERT_TRUE(d.law);
  EXPECT_EQ(d.law->text.id, "friction_over_angle_1");
  EXPECT_LT(blind::curve_error(
                *d.law, "theta", [](double theta) { return -0.12 * std::cos(theta); }, false),
            0.1);
}

/// [N m] A pull that is straight between nine values of a turn. The shaft is not at rest under it where a run begins.
double pull_of_nine_values(double theta) {
  constexpr std::array value{0.029, -0.013, 0.021, -0.026, 0.005, 0.018, -0.030, 0.011, -0.015};
  constexpr double two_pi = 6.283185307179586;
  const double at = (theta / two_pi - std::floor(theta / two_pi)) * value.size();
  const std::size_t k = std::min(static_cast<std::size_t>(at), value.size() - 1);
  return std::lerp(value[k], value[(k + 1) % value.size()], at - static_cast<double>(k));
}

TEST(Discover, TellsAPullOverTheAngleHoweverLittleOfTheMotionItIs) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double, double theta, double) { return -pull_of_nine_values(theta); };
  bench.channels.push_back({.signal = Signal::theta, .low = -6283, .high = 6283, .bits = 23, .noise = 0});
  const Discovery d = discover_on(bench);
  EXPECT_LT(d.rmse.at(Signal::omega), 0.02 * 300) << "too little for a verdict, or it says nothing of such a case";
  ASSERT_TRUE(d.law);
  EXPECT_GT(d.law->parameters.size(), 8U);
  EXPECT_GT(d.law->held_out_before, 5);
  EXPECT_LT(d.law->held_out_after, 2.5);
  EXPECT_LT(blind::curve_error(*d.law, "theta", pull_of_nine_values, false), 0.05);
}

TEST(Discover, OffersNoLawToAHealthyMotor) {
  const Discovery d = discover_on(blind::fast_bench(), 7);
  EXPECT_FALSE(d.worth_a_name);
  EXPECT_FALSE(d.law);
  EXPECT_TRUE(d.changed.empty());
  EXPECT_TRUE(d.disturbances.empty());
}

TEST(Discover, TheSmootherRecoversATorqueWithItsBand) {
  const blind::Bench bench = bench_with_a_bump();
  const Discovery d = discover_on(bench);
  double squares = 0, inside = 0, count = 0;
  for (const MissingTorque& run : d.left.runs) {
    for (std::size_t k = 0; k < run.t.size(); ++k) {
      EXPECT_TRUE(std::isfinite(run.torque[k]));
      EXPECT_GT(run.torque_error[k], 0);
      squares += run.torque[k] * run.torque[k];
      inside += std::abs(run.torque[k]) < 0.02 ? 1 : 0;
      ++count;
    }
  }
  EXPECT_LT(std::sqrt(squares / count), 0.01) << "no larger than what is hidden";
  EXPECT_GT(inside / count, 0.98);
  EXPECT_TRUE(d.left.voltage_seen);
  EXPECT_GT(d.torque.rms, 0);
}

TEST(SameMachine, TellsTheRunWithAnotherResistance) {
  blind::Bench bench = blind::fast_bench(), other = bench;
  other.plant.motor.R_a *= 1.15;
  std::vector<emtb::Run> runs = record(bench, bench.train, 1);
  runs[1] = record(other, other.train[1], 2);
  const Discovery d = discover(runs, record(bench, bench.held_out, 101), bench.model, {.read = read, .progress = {}});
  ASSERT_EQ(d.changed.size(), 1U);
  EXPECT_EQ(d.changed[0].parameter, "R_a");
  EXPECT_EQ(d.changed[0].run, runs[1].name);
  EXPECT_NEAR(d.changed[0].to / d.changed[0].from, 1.15, 0.03);
}

/// Samples of a motor that turns both ways at speeds up to 50 rad/s, but none between two speeds.
Samples some_samples(double above = 0, double below = 0) {
  Samples s;
  s.groups = 2;
  for (int i = 0; i < 100; ++i) {
    const double omega = i - 50.5;
    if (std::abs(omega) > above && std::abs(omega) < below) continue;
    s.group.push_back(i < 50 ? 0 : 1);
    s.omega.push_back(omega);
    s.i_a.push_back(0.1 * (i % 7) - 0.3);
    s.theta.push_back(0.3 * i);
    s.t.push_back(0.1 * i);
    s.u_ref.push_back(1);
    s.acceleration.push_back(i % 5);
    s.value.push_back(0);
  }
  return s;
}

std::size_t free_parameters(const AddedTerm& term) {
  std::size_t free = 0;
  for (const Parameter& p : term.parameters) free += p.fixed ? 0 : 1;
  return free;
}

TEST(Grammar, EachSentenceIsReadAsACandidate) {
  for (const bool voltage : {false, true}) {
    for (const FormulaText& text : sentences(some_samples(), 1, 1, voltage)) {
      const AddedTerm term = read(text);
      EXPECT_LE(free_parameters(term), 3U) << text.id;
      EXPECT_EQ(term.formula, text.formula);
      EXPECT_FALSE(text.is_curve);
    }
  }
}

TEST(Curves, AreReadAsCandidatesAndAreTheirOwnValues) {
  const std::vector<FormulaText> all = curves(some_samples(), 1, 1, false);
  EXPECT_THAT(all, testing::Contains(testing::Field(&FormulaText::id, "curve_of_8_torque_of_omega")));
  EXPECT_THAT(all, testing::Contains(testing::Field(&FormulaText::id, "curve_of_8_waves_of_friction_over_angle")));
  for (const FormulaText& text : all) {
    EXPECT_TRUE(text.is_curve);
    const auto values = std::ranges::count_if(text.parameters, &FormulaText::Parameter::amplitude);
    EXPECT_EQ(free_parameters(read(text)), static_cast<std::size_t>(values)) << text.id;
  }
  const AddedTerm term = read(*std::ranges::find(all, "curve_from_zero_of_4_torque_of_omega", &FormulaText::id));
  std::vector<double> p, by(4);
  for (const Parameter& one : term.parameters) {
    p.push_back(one.symbol == "c1" ? 1 : one.symbol == "c2" ? 2 : one.symbol == "c3" ? 3 : one.value);
  }
  TermInput by_input;
  const double apart = 50.5 / 4;
  for (const double way : {-1.0, 1.0}) {
    EXPECT_NEAR(term.term->evaluate({way * apart, 0, 0, 0, 0}, p, by_input, by), -way * 1, 1e-3);
    EXPECT_NEAR(term.term->evaluate({way * 2.5 * apart, 0, 0, 0, 0}, p, by_input, by), -way * 2.5, 1e-3);
    EXPECT_NEAR(term.term->evaluate({way * 4 * apart, 0, 0, 0, 0}, p, by_input, by), 0, 1e-3) << "the line is B's";
  }
}

TEST(Curves, AreToldByNoMoreValuesThanTheSamplesReach) {
  const std::vector<FormulaText> gap = curves(some_samples(10, 45), 1, 1, false);
  for (const FormulaText& text : gap) EXPECT_FALSE(text.id.ends_with("of_omega")) << text.id;
}

}  // namespace
}  // namespace emtb
