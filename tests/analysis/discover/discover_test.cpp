#include "analysis/discover/discover.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "config/formula_effect.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

AddedTerm read(const FormulaText& text) { return read_formula(YamlMap::parse(text.yaml(), "a law"), text.id); }

Discovery discover_on(const blind::Bench& bench, std::uint64_t seed = 1) {
  return discover(record(bench, bench.train, seed), record(bench, bench.held_out, 100 + seed), bench.model,
                  {.read = read, .progress = {}});
}

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

TEST(Grammar, EachSentenceIsReadAsACandidate) {
  Samples s;
  s.groups = 2;
  for (int i = 0; i < 100; ++i) {
    s.group.push_back(i < 50 ? 0 : 1);
    s.omega.push_back(i - 50.5);
    s.i_a.push_back(0.1 * (i % 7) - 0.3);
    s.theta.push_back(0.3 * i);
    s.t.push_back(0.1 * i);
    s.u_ref.push_back(1);
    s.acceleration.push_back(i % 5);
    s.value.push_back(0);
  }
  for (const bool voltage : {false, true}) {
    for (const FormulaText& text : sentences(s, 1, 1, voltage)) {
      const AddedTerm term = read(text);
      std::size_t free = 0;
      for (const Parameter& p : term.parameters) free += p.fixed ? 0 : 1;
      EXPECT_LE(free, 3U) << text.id;
      EXPECT_EQ(term.formula, text.formula);
    }
  }
}

}  // namespace
}  // namespace emtb
