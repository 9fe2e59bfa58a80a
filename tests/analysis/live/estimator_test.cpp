#include "analysis/live/estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <random>

#include "hal/error.h"
#include "tests/analysis/live/live_bench.h"

namespace emtb {
namespace {

using namespace live_bench;

LiveEstimates follow(const LiveBench& bench, const Run& run) {
  LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
  feed(estimator, run);
  return estimator.estimates();
}

Parameter& model_parameter(Model& model, const std::string& symbol) {
  return *std::ranges::find(model.base, symbol, &Parameter::symbol);
}

double normalised(const LiveEstimates& e, Signal signal) {
  return std::ranges::find(e.innovation, signal, &LiveInnovation::signal)->normalised;
}

const std::vector<Knot> half_a_minute{{0, 0}, {2, 0}, {2, 4}, {12, 4}, {12, 2}, {20, 2}, {20, 6}, {30, 6}};

/// The bench through that, then an hour at one level.
struct LongHold {
  LongHold(LiveBench bench, double level) : estimator(bench.model, bench.channels(), bench.setup.rate) {
    std::vector<Knot> knots = half_a_minute;
    knots.insert(knots.end(), {{30, level}, {50, level}});
    feed(estimator, simulated::record(bench.setup, Profile("long", knots), 1));
    before = estimator.estimates();
    // From where it has settled, the instruments' own noise alone: the plant would take half a minute for the hour.
    LiveBench silent = bench;
    for (auto& c : silent.setup.channels) c.noise = 0, c.bits = 0;
    const emtb::Run settled = simulated::record(silent.setup, Profile("quiet", knots), 1);
    std::mt19937_64 random(1);
    std::normal_distribution<double> normal;
    const double period = 1 / bench.setup.rate;
    for (long k = 1; k <= std::lround(3600 / period); ++k) {
      const double t = 50 + static_cast<double>(k) * period;
      for (const auto& c : bench.setup.channels) {
        if (c.signal == Signal::u_ref) continue;
        estimator.take(c.signal, t,
                       simulated::quantise(c, settled.at(c.signal).value.back() + c.noise * normal(random)));
      }
      const long each = std::lround(bench.setup.meter->period / period);
      if (k % each == 0) estimator.take(Signal::i_a, t, settled.at(Signal::i_a).value.back());
      estimator.take(Signal::u_ref, t, level);
    }
    after = estimator.estimates();
  }

  LiveEstimator estimator;
  LiveEstimates before, after;
};

// Where they are, after a minute, as far as they say: the numbers for 100 seeds are in
// docs/decisions/live-estimates.md.
class LiveCoverage : public testing::TestWithParam<double> {};

TEST_P(LiveCoverage, TwoStandardErrorsCoverTheTruthOfBothBenches) {
  int covered = 0, all = 0;
  for (LiveBench bench : {slow_live_bench(), fast_live_bench()}) {
    bench.colour_tacho(GetParam());
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      const LiveEstimates e = follow(bench, simulated::record(bench.setup, bench.staircase, seed));
      for (const auto& [name, truth] : bench.truth) {
        ++all;
        covered += std::abs(in_errors(e, name, truth)) <= 2 ? 1 : 0;
        EXPECT_LT(std::abs(in_errors(e, name, truth)), 6) << name << ", seed " << seed;
        EXPECT_NEAR(parameter(e, name).value, truth, 0.02 * truth) << name << ", seed " << seed;
        EXPECT_TRUE(parameter(e, name).excited) << name;
      }
    }
  }
  EXPECT_GE(covered, 22) << "of " << all;  // of 27 at 95 %: fewer than 22 once in a thousand
}
INSTANTIATE_TEST_SUITE_P(NoiseWhiteAndColoured, LiveCoverage, testing::Values(0.0, 0.97));

TEST(LiveEstimator, AMotorThatStandsForAnHourTeachesNothingAndForgetsNothing) {
  LiveBench bench = slow_live_bench();
  bench.setup.rate = 100;
  const LongHold hold(bench, 0);
  for (const auto& [name, truth] : bench.truth) {
    const LiveParameter &before = parameter(hold.before, name), &after = parameter(hold.after, name);
    EXPECT_FALSE(after.excited) << name;
    EXPECT_NEAR(after.value, before.value, 0.5 * before.std_error) << name;
    EXPECT_NEAR(after.std_error, before.std_error, 0.5 * before.std_error) << name;
  }
}

TEST(LiveEstimator, AnHourAtOneSpeedMovesOnlyWhatItInforms) {
  LiveBench bench = slow_live_bench();
  bench.setup.rate = 100;
  const LongHold hold(bench, 3);
  const LiveParameter &before = parameter(hold.before, "J"), &after = parameter(hold.after, "J");
  EXPECT_FALSE(after.excited);
  // What else it learns may pull at it, within what is known of it.
  EXPECT_NEAR(after.value, before.value, 3 * before.std_error);
  EXPECT_LT(std::abs(in_errors(hold.after, "J", bench.truth.at("J"))), 3);
  EXPECT_GT(after.std_error, 0.3 * before.std_error);
  for (const auto& [name, truth] : bench.truth) EXPECT_LT(std::abs(in_errors(hold.after, name, truth)), 6) << name;
}

TEST(LiveEstimator, AGapCostsTheStatesNotTheParameters) {
  for (const LiveBench& bench : {slow_live_bench(), fast_live_bench()}) {
    LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
    const emtb::Run run = simulated::record(bench.setup, bench.staircase, 3);
    feed(estimator, run, [](Signal, double t, double&) { return t < 29 || t > 31.7; });
    const LiveEstimates e = estimator.estimates();
    EXPECT_EQ(e.gaps, 1U);
    for (const auto& [name, truth] : bench.truth) EXPECT_LT(std::abs(in_errors(e, name, truth)), 6) << name;
  }
}

TEST(LiveEstimator, WhatIsNotANumberIsSkipped) {
  const LiveBench bench = fast_live_bench();
  LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
  const emtb::Run run = simulated::record(bench.setup, bench.staircase, 4);
  std::uint64_t reading = 0, spoilt = 0;
  feed(estimator, run, [&](Signal, double, double& value) {
    if (++reading % 7 == 0) {
      value = reading % 2 == 0 ? std::numeric_limits<double>::quiet_NaN() : std::numeric_limits<double>::infinity();
      ++spoilt;
    }
    return true;
  });
  const LiveEstimates e = estimator.estimates();
  EXPECT_EQ(e.skipped, spoilt);
  for (const auto& [name, truth] : bench.truth) EXPECT_LT(std::abs(in_errors(e, name, truth)), 6) << name;
}

TEST(LiveEstimator, AMeterIsComparedWithTheMeanOfItsWindowHoweverLateItComes) {
  LiveBench bench = slow_live_bench();
  bench.setup.meter->period = 1.3;
  bench.setup.meter->window = 1.1;
  bench.setup.meter->latency = 0.2;
  const LiveEstimates e = follow(bench, simulated::record(bench.setup, bench.staircase, 5));
  for (const auto& [name, truth] : bench.truth) EXPECT_LT(std::abs(in_errors(e, name, truth)), 6) << name;
}

TEST(LiveEstimator, BoundsPriorsTiesAndFixedValuesOfTheModelFileHold) {
  LiveBench bench = slow_live_bench();
  model_parameter(bench.model, "K_b").max = 0.65;  // the truth is beyond
  model_parameter(bench.model, "R_a").prior = Prior{.value = 31.8, .std = 0.001};
  model_parameter(bench.model, "J").fixed = true;
  const LiveEstimates e = follow(bench, simulated::record(bench.setup, bench.staircase, 6));
  EXPECT_LE(parameter(e, "K_b").value, 0.65);
  EXPECT_EQ(parameter(e, "K_m").value, parameter(e, "K_b").value);
  EXPECT_EQ(parameter(e, "K_m").std_error, parameter(e, "K_b").std_error);
  EXPECT_NEAR(parameter(e, "R_a").value, 31.8, 0.02);
  EXPECT_TRUE(parameter(e, "J").fixed);
  EXPECT_EQ(parameter(e, "J").value, model_parameter(bench.model, "J").value);
}

TEST(LiveEstimator, AModelThatLacksTheFrictionShowsIt) {
  LiveBench bench = slow_live_bench();
  const emtb::Run run = simulated::record(bench.setup, bench.staircase, 7);
  const double right = normalised(follow(bench, run), Signal::omega);
  bench.model.exclude(effect_index("coulomb_friction"));
  LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
  double worst = 0;
  feed(estimator, run, [&](Signal signal, double t, double&) {
    if (signal == Signal::u_ref && t > 10 && std::fmod(t, 1.0) < 1e-3) {
      worst = std::max(worst, normalised(estimator.estimates(), Signal::omega));
    }
    return true;
  });
  EXPECT_LT(right, 1.6);
  EXPECT_GT(worst, 5);
}

TEST(LiveEstimator, SaysThatValuesOfAModelThatDoesNotFitAreNotToBeTrusted) {
  for (LiveBench bench : {slow_live_bench(), fast_live_bench()}) {
    const emtb::Run run = simulated::record(bench.setup, bench.staircase, 7);
    const LiveEstimates right = follow(bench, run);
    EXPECT_TRUE(right.fits);
    for (const auto& [signal, floors] : right.left) EXPECT_LT(floors, 1.5) << info(signal).name;
  }
  LiveBench lacking = slow_live_bench();
  const emtb::Run run = simulated::record(lacking.setup, lacking.staircase, 7);
  lacking.model.exclude(effect_index("coulomb_friction"));
  const LiveEstimates e = follow(lacking, run);
  EXPECT_FALSE(e.fits);
  EXPECT_GT(e.left.at(Signal::omega), 3);
}

TEST(LiveEstimator, AValueAtItsBoundIsNoEstimate) {
  LiveBench bench = slow_live_bench();
  model_parameter(bench.model, "K_b").max = 0.65;  // the truth is beyond
  const LiveEstimates e = follow(bench, simulated::record(bench.setup, bench.staircase, 6));
  EXPECT_TRUE(parameter(e, "K_b").at_bound);
  EXPECT_FALSE(parameter(e, "K_b").excited);
  EXPECT_FALSE(parameter(e, "J").at_bound);
  EXPECT_FALSE(e.fits);
}

// The paper's bench after its first step, with a model that lacks the friction: the values lie far off.
TEST(LiveEstimator, AFirstStepThatTheModelCannotFollowTellsNothing) {
  LiveBench bench = slow_live_bench();
  bench.model.exclude(effect_index("coulomb_friction"));
  LiveEstimator estimator(bench.model, bench.channels(), bench.setup.rate);
  const Profile one_step("one step", std::vector<Knot>{{0, 0}, {2, 0}, {2, 4}, {14, 4}});
  const emtb::Run run = simulated::record(bench.setup, one_step, 3);
  feed(estimator, run, [&](Signal signal, double t, double&) {
    if (signal == Signal::u_ref && t > 8 && std::fmod(t, 1.0) < 1e-3) {
      const LiveEstimates e = estimator.estimates();
      for (const LiveParameter& p : e.parameters) {
        EXPECT_FALSE(p.at_bound && p.excited) << p.name;
        const auto truth = bench.truth.find(p.name);
        if (truth == bench.truth.end() || p.fixed || !e.fits || !p.excited) continue;
        EXPECT_LT(std::abs(p.value - truth->second), 6 * p.std_error) << p.name << " at " << t << " s";
      }
      EXPECT_FALSE(e.fits) << t;
      for (const LiveSuspect& suspect : e.misfit.points_to) EXPECT_NE(suspect.name, "tacho_offset.omega_0") << t;
    }
    return true;
  });
}

TEST(LiveEstimator, AModelThatTheBenchCannotDriveIsRefused) {
  LiveBench bench = slow_live_bench();
  bench.model.input = Signal::i_a;  // a slow meter's
  EXPECT_THROW(LiveEstimator(bench.model, bench.channels(), bench.setup.rate), ModelError);
}

}  // namespace
}  // namespace emtb
