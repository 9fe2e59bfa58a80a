#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "analysis/fit/residuals.h"
#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using synthetic::servo_model;

/// A run of constant references, 4 s each, and a speed that has settled but for its noise.
ObservedRun settled_run(const std::vector<double>& noise, double lsb = 0) {
  emtb::Run run;
  run.name = "settled";
  const double interval = 1e-3, seconds = static_cast<double>(noise.size()) * interval;
  run.signals[Signal::u_ref] = series(interval, seconds, [](double t) { return 1 + std::floor(t / 4); });
  Series omega = run.at(Signal::u_ref);
  for (std::size_t k = 0; k < omega.value.size(); ++k) omega.value.edit()[k] = 80 * omega.value[k] + noise[k];
  omega.lsb = lsb;
  run.signals[Signal::omega] = omega;
  return observe_run(run, servo_model());
}

NoiseFloor floor_of_omega(const ObservedRun& run, const Model& model = servo_model()) {
  return estimate_noise(std::span(&run, 1), model).at(Signal::omega);
}

using OverTime = std::function<double(double)>;

/// A run of so many seconds with a current whose meter averages over an interval.
emtb::Run slow_meter_run(double seconds, double interval, const OverTime& u_ref, const OverTime& omega,
                         const OverTime& i_a) {
  emtb::Run run;
  run.name = "slow meter";
  run.signals[Signal::u_ref] = series(1e-3, seconds, u_ref);
  run.signals[Signal::omega] = series(1e-3, seconds, omega);
  Series current = series(interval, seconds, i_a);
  current.window = interval;
  run.signals[Signal::i_a] = current;
  return run;
}

NoiseFloor floor_of_i_a(const emtb::Run& run) {
  const ObservedRun prepared = observe_run(run, servo_model());
  return estimate_noise(std::span(&prepared, 1), servo_model()).at(Signal::i_a);
}

std::vector<double> scaled(std::vector<double> x, double by) {
  for (double& v : x) v *= by;
  return x;
}

TEST(NoiseFloor, IsTheScatterOfSettledReadingsAlsoWhereItIsColoured) {
  for (const double rho : {0.0, 0.5, 0.9}) {
    const NoiseFloor floor = floor_of_omega(settled_run(scaled(synthetic::coloured(24'000, rho, 7), 0.15)));
    EXPECT_NEAR(floor.sigma, 0.15, 0.015) << rho;
    EXPECT_NEAR(floor.autocorrelation, rho, 0.05) << rho;
    EXPECT_EQ(floor.from, FloorSource::settled);
    EXPECT_FALSE(floor.lower_bound);
  }
}

TEST(NoiseFloor, OfAShortRunIsToldByStretchesAsShortAsItsMachine) {
  synthetic::Noise noise(5);
  emtb::Run run;
  run.name = "a small servo";
  run.signals[Signal::u_ref] = synthetic::series(1e-4, 0.4, [](double t) { return 1 + std::floor(t / 0.1); });
  run.signals[Signal::omega] =
      synthetic::series(1e-4, 0.4, [&](double t) { return 80 * (1 + std::floor(t / 0.1)) + noise(0.15); });
  const NoiseFloor floor = floor_of_omega(observe_run(run, servo_model()));
  EXPECT_EQ(floor.from, FloorSource::settled);
  EXPECT_NEAR(floor.sigma, 0.15, 0.02);
}

TEST(NoiseFloor, AControllerThatAnswersAReadingInItsOwnRowTakesNothingOfItsNoise) {
  constexpr double speed = 80, noise_of_it = 0.15, gain = 0.01;  // [rad/s], [rad/s], [V s/rad]
  synthetic::Noise noise(5);
  emtb::Run run;
  run.name = "closed loop";
  run.signals[Signal::omega] = series(1e-3, 8, [&](double) { return speed + noise(noise_of_it); });
  Series u_ref = run.at(Signal::omega);
  for (double& u : u_ref.value.edit()) u = 1 - gain * (u - speed);
  run.signals[Signal::u_ref] = u_ref;
  const NoiseFloor floor = floor_of_omega(observe_run(run, servo_model()));
  EXPECT_EQ(floor.from, FloorSource::settled);
  EXPECT_NEAR(floor.sigma, noise_of_it, 0.01);
}

TEST(NoiseFloor, ASlowDriftIsNotNoise) {
  std::vector<double> noise = scaled(synthetic::coloured(24'000, 0, 3), 0.1);
  for (std::size_t k = 0; k < noise.size(); ++k) noise[k] += 2e-4 * static_cast<double>(k);  // 0.2 rad/s2: it warms up
  EXPECT_NEAR(floor_of_omega(settled_run(noise)).sigma, 0.1, 0.01);
}

TEST(NoiseFloor, WhatShakesTheMachineIsNotNoise) {
  std::vector<double> noise = scaled(synthetic::coloured(24'000, 0.9, 3), 0.1);
  for (std::size_t k = 0; k < noise.size(); ++k)
    noise[k] += 0.3 * std::sin(2 * std::numbers::pi * 7e-3 * static_cast<double>(k));
  EXPECT_NEAR(floor_of_omega(settled_run(noise)).sigma, 0.1, 0.02);
}

TEST(NoiseFloor, OfASlowMeterIsToldByAFewReadingsInEachOfManyStretches) {
  const auto level = [](double t) { return std::fmod(std::floor(t / 4), 3); };
  synthetic::Noise noise(4);
  const NoiseFloor floor = floor_of_i_a(slow_meter_run(
      64, 0.5, level, [&](double t) { return 80 * level(t); }, [&](double t) { return level(t - 0.5) + noise(0.01); }));
  EXPECT_EQ(floor.from, FloorSource::settled);
  EXPECT_NEAR(floor.sigma, 0.01, 0.003);
}

TEST(NoiseFloor, OfASlowMeterIsNotTheLastPartOfARelaxation) {
  synthetic::Noise noise(5);
  const auto level = [](double t) { return std::fmod(std::floor(t / 4), 2); };
  const auto left = [](double t) { return std::exp(-std::fmod(t, 4.0) / 0.9); };  // of the change
  const auto sign = [&](double t) { return level(t) > 0 ? 1.0 : -1.0; };
  const emtb::Run run = slow_meter_run(
      64, 0.4, level, [&](double t) { return 80 * (level(t) - sign(t) * left(t)) + noise(0.1); },
      [&](double t) { return 0.2 + 0.5 * sign(t - 0.2) * left(t - 0.2) + noise(0.001); });
  EXPECT_LT(floor_of_i_a(run).sigma, 0.006);
}

TEST(NoiseFloor, OfASlowMeterLeavesOutTheBeginningOfAPlateauWhereTheCurrentStillRelaxes) {
  synthetic::Noise noise(6);
  const auto level = [](double t) { return std::fmod(std::floor(t / 10), 3); };
  // Of the change: 7 of 10 s pass until the current rests.
  const auto left = [](double t) { return std::exp(-std::max(0.0, std::fmod(t, 10.0) - 5) / 0.5); };
  const NoiseFloor floor = floor_of_i_a(slow_meter_run(
      120, 0.4, level, [&](double t) { return 80 * level(t) + noise(0.1); },
      [&](double t) { return 0.2 + 0.1 * left(t - 0.2) + noise(0.002); }));
  EXPECT_EQ(floor.from, FloorSource::settled);
  EXPECT_NEAR(floor.sigma, 0.002, 0.0004);
}

/// A meter that reads the mean current of each half second of a motor that never settles, with a noise of 10 mA.
emtb::Run never_settled(int holds, unsigned seed = 9) {
  const synthetic::Truth truth;
  std::vector<synthetic::Hold> plan;
  for (int k = 0; k < holds; ++k) plan.push_back({0.4, k % 3 == 0 ? 1.0 : k % 3 == 1 ? 4.0 : -2.0});
  emtb::Run run = synthetic::record(truth, plan, 1e-3, {.omega = 0.1, .i_a = 0, .e_a = 0.01});
  const Series fast = run.at(Signal::i_a);
  synthetic::Noise noise(seed);
  Series slow;
  slow.window = 0.5;
  for (std::size_t k = 500; k < fast.t.size(); k += 500) {
    double mean = 0;
    for (std::size_t j = k - 499; j <= k; ++j) mean += fast.value[j] / 500;
    slow.t.push_back(fast.t[k]);
    slow.value.push_back(mean + noise(0.01));
  }
  run.signals[Signal::i_a] = slow;
  return run;
}

TEST(NoiseFloor, OfASlowMeterThatNeverSettlesIsToldByTheFastSignalsBesideIt) {
  const NoiseFloor floor = floor_of_i_a(never_settled(60));
  EXPECT_EQ(floor.from, FloorSource::regression);
  EXPECT_NEAR(floor.sigma, 0.01, 0.006);
}

TEST(NoiseFloor, OfAFewSlowReadingsIsNotHowTheCurrentMoves) {
  const emtb::Run run = never_settled(12);
  EXPECT_EQ(run.at(Signal::i_a).value.size(), 9);
  const NoiseFloor floor = floor_of_i_a(run);
  EXPECT_EQ(floor.from, FloorSource::regression);
  EXPECT_LT(floor.sigma, 0.03);
}

TEST(NoiseFloor, OfThreeReadingsARunIsNotNothing) {
  std::vector<ObservedRun> runs;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    const emtb::Run run = never_settled(4, seed);
    ASSERT_EQ(run.at(Signal::i_a).value.size(), 3U);
    runs.push_back(observe_run(run, servo_model()));
  }
  const NoiseFloor floor = estimate_noise(runs, servo_model()).at(Signal::i_a);
  EXPECT_EQ(floor.from, FloorSource::regression) << "third differences there are none of";
  EXPECT_NEAR(floor.sigma, 0.01, 0.006);
}

TEST(NoiseFloor, OfAMeterAloneOfWhichNothingIsKnownIsAThousandthOfItsRange) {
  emtb::Run run = slow_meter_run(
      1.2, 0.4, [](double) { return 2.0; }, [](double) { return 80.0; }, [](double t) { return t; });
  run.signals.erase(Signal::omega);
  const NoiseFloor floor = floor_of_i_a(run);
  EXPECT_EQ(floor.from, FloorSource::assumed);
  EXPECT_DOUBLE_EQ(floor.sigma, 1e-3 * (0.8 - 0.4)) << "what it read at 0 s it had begun before";
}

TEST(NoiseFloor, WhatTheModelDeclaresWins) {
  const ObservedRun run = settled_run(scaled(synthetic::coloured(24'000, 0, 3), 0.1), 0.5);
  Model model = servo_model();
  model.noise[Signal::omega] = 0.7;
  EXPECT_EQ(floor_of_omega(run, model).sigma, 0.7);
  EXPECT_EQ(floor_of_omega(run, model).from, FloorSource::declared);
  model.noise[Signal::omega] = 0.01;
  EXPECT_NEAR(floor_of_omega(run, model).sigma, 0.5 / std::sqrt(12.0), 1e-12)
      << "but no instrument is better than its steps";
}

TEST(NoiseFloor, IsNeverBelowTheResolution) {
  const NoiseFloor floor = floor_of_omega(settled_run(std::vector<double>(24'000, 0.0), 0.6));
  EXPECT_NEAR(floor.sigma, 0.6 / std::sqrt(12.0), 1e-12);
  EXPECT_EQ(floor.from, FloorSource::resolution);
}

TEST(NoiseFloor, FromDifferencesIsFlaggedAsALowerBound) {
  emtb::Run run;
  run.name = "ramp";
  run.signals[Signal::u_ref] = series(1e-3, 8, [](double t) { return 0.5 * t; });  // never settles
  synthetic::Noise noise(5);
  run.signals[Signal::omega] = series(1e-3, 8, [&](double t) { return 40 * t + noise(0.2); });
  const ObservedRun prepared = observe_run(run, servo_model());
  const NoiseFloor floor = floor_of_omega(prepared);
  EXPECT_EQ(floor.from, FloorSource::differences);
  EXPECT_TRUE(floor.lower_bound);
  EXPECT_NEAR(floor.sigma, 0.2, 0.02);  // white: as it should be
}

/// A reference that never rests, and noise of rho 0.9 that third differences take for a sixth of what it is.
ObservedRun swinging_run(unsigned seed, double faster = 1, double drift = 0) {
  emtb::Run run;
  run.name = "swinging";
  run.signals[Signal::u_ref] =
      series(1e-3, 12, [&](double t) { return 2 + std::sin(2 * std::numbers::pi * 0.5 * faster * t); });
  Series omega = run.at(Signal::u_ref);
  const std::vector<double> noise = synthetic::coloured(omega.value.size(), 0.9, seed);
  for (std::size_t k = 0; k < noise.size(); ++k) {
    omega.value.edit()[k] = 80 * omega.value[k] + 0.15 * noise[k] + drift * omega.t[k];
  }
  run.signals[Signal::omega] = omega;
  return observe_run(run, servo_model());
}

TEST(NoiseFloor, OfRunsThatNeverSettleIsToldByTheirRepeats) {
  const std::vector<ObservedRun> runs{swinging_run(1), swinging_run(2), swinging_run(3)};
  const NoiseFloor floor = estimate_noise(runs, servo_model()).at(Signal::omega);
  EXPECT_NEAR(floor.sigma, 0.15, 0.015);
  EXPECT_NEAR(floor.autocorrelation, 0.9, 0.05);
  EXPECT_EQ(floor.from, FloorSource::repeats);
  EXPECT_FALSE(floor.lower_bound);
}

/// [A] What a bridge drives, for eight seconds of thirty.
double drives(double t) { return t > 10 && t < 14 ? 1.0 : t > 14 && t < 18 ? 2.0 : 0.0; }

/// The floor of its current. @param beside what is read beside it
double floor_behind_a_bridge(const OverTime& beside) {
  emtb::Run run;
  run.name = "mostly idle";
  synthetic::Noise noise(7);
  run.signals[Signal::u_ref] = series(1e-3, 30, drives);
  run.signals[Signal::i_a] = series(1e-3, 30, [&](double t) { return drives(t) + beside(t); });
  run.signals[Signal::omega] = series(1e-3, 30, [&](double t) { return 50 * drives(t) + noise(0.1); });
  return floor_of_i_a(run).sigma;
}

TEST(NoiseFloor, OfACurrentIsThatOfABridgeThatDrivesAlsoWhereItIsMostlyIdle) {
  synthetic::Noise noise(8);
  EXPECT_NEAR(floor_behind_a_bridge([&](double t) { return noise(drives(t) > 0 ? 0.025 : 0.0001); }), 0.025, 0.002);
}

TEST(NoiseFloor, OfACurrentIsNotWhatALoadDoesToItWhileItDrives) {
  synthetic::Noise noise(8);
  const std::vector<double> drift = scaled(synthetic::coloured(30001, 0.99, 5), 0.01);
  const auto load = [&](double t) { return drives(t) > 0 ? drift[static_cast<std::size_t>(t / 1e-3)] : 0; };
  EXPECT_NEAR(floor_behind_a_bridge([&](double t) { return noise(0.001) + load(t); }), 0.001, 0.0003);
}

TEST(NoiseFloor, OfACurrentInAShortRunIsThatOfABridgeThatDrives) {
  emtb::Run run;
  run.name = "short";
  synthetic::Noise noise(7);
  const auto pulse = [](double t) { return t > 0.8 && t < 1.4 ? 1.0 : 0.0; };
  run.signals[Signal::u_ref] = series(2.5e-2, 2, pulse);
  run.signals[Signal::i_a] =
      series(2.5e-2, 2, [&](double t) { return pulse(t) + noise(pulse(t) > 0 ? 0.025 : 0.0001); });
  run.signals[Signal::omega] = series(2.5e-2, 2, [&](double t) { return 50 * pulse(t) + noise(0.1); });
  const NoiseFloor floor = floor_of_i_a(run);
  EXPECT_EQ(floor.from, FloorSource::differences);
  EXPECT_NEAR(floor.sigma, 0.025, 0.012);
}

TEST(NoiseFloor, RepeatsOfAnIdleBridgeSayNothingOfOneThatDrives) {
  const auto idle = [](unsigned seed) {
    emtb::Run run;
    run.name = "idle";
    synthetic::Noise noise(seed);
    run.signals[Signal::u_ref] = series(1e-3, 0.04, [](double) { return 0.0; });
    run.signals[Signal::omega] = series(1e-3, 0.04, [&](double) { return noise(0.001); });
    return observe_run(run, servo_model());
  };
  std::vector<ObservedRun> runs{swinging_run(1), swinging_run(2)};
  for (unsigned seed = 1; seed < 30; ++seed) runs.push_back(idle(seed));
  const NoiseFloor floor = estimate_noise(runs, servo_model()).at(Signal::omega);
  EXPECT_EQ(floor.from, FloorSource::repeats);
  EXPECT_NEAR(floor.sigma, 0.15, 0.015);
}

TEST(NoiseFloor, WhatDriftsFromRepeatToRepeatIsNotNoise) {
  const std::vector<ObservedRun> runs{swinging_run(1), swinging_run(2, 1, 0.2)};  // [rad/s2] it warms up
  EXPECT_NEAR(estimate_noise(runs, servo_model()).at(Signal::omega).sigma, 0.15, 0.015);
}

TEST(NoiseFloor, RunsOfDifferentReferencesAreNoRepeats) {
  const std::vector<ObservedRun> runs{swinging_run(1), swinging_run(2, 1.5)};
  EXPECT_EQ(estimate_noise(runs, servo_model()).at(Signal::omega).from, FloorSource::differences);
}

TEST(Weigh, WidensTheVoltageWhereItsEdgesAreAndNowhereElse) {
  emtb::Run run = synthetic::record({}, {{1, 0}, {1.5, 2}}, 1e-3, {.e_a = 0.05});
  Model model = servo_model();
  model.noise = {{Signal::omega, 0.1}, {Signal::i_a, 0.01}, {Signal::e_a, 0.05}};
  const std::vector<Record> records = prepare(std::vector{run}, {}, model).train;
  const auto e_a = std::ranges::find(records[0].observations, Signal::e_a, &Observation::signal);
  EXPECT_NEAR(e_a->sigma[500], 0.05, 1e-8);
  EXPECT_GT(e_a->sigma[1002], 0.5);  // 2 V a sample, which half a sample of timing may shift
  EXPECT_NEAR(e_a->sigma[1500], 0.05, 1e-8);
  const auto omega = std::ranges::find(records[0].observations, Signal::omega, &Observation::signal);
  for (const double sigma : omega->sigma.values()) ASSERT_LE(sigma, 0.4);  // the noise of the voltage drives it
  EXPECT_NEAR(omega->sigma[500], 0.1, 0.02);
}

TEST(Weigh, CarriesWhatAVoltmeterRoundsIntoTheSpeedForAsLongAsItsReadingStands) {
  const auto sigma_of_speed = [](double step) {  // [V]
    emtb::Run run = synthetic::record({}, {{1, 0.5}, {3, 2.3}, {3, 1.4}}, 1e-3, {.omega = 0.1, .i_a = 0.01});
    for (double& e : run.signals[Signal::e_a].value.edit()) e = step * std::round(e / step);
    run.signals[Signal::e_a].lsb = step;
    return prepare(std::vector{run}, {}, servo_model()).train[0].find(Signal::omega)->sigma[3900];
  };
  EXPECT_NEAR(sigma_of_speed(0.2), 0.2 / std::sqrt(12.0) / 0.042, 0.4);
  EXPECT_NEAR(sigma_of_speed(1e-3), 0.1, 0.02);
}

TEST(Weigh, CarriesTheNoiseOfTheGaugeIntoWhatTheModelPredicts) {
  // The truth has no gauge: an eddy brake of 4e-5 N m s/rad is what the gauge reads, and noise.
  synthetic::Truth braked;
  braked.B += 4e-5;
  Model truth = servo_model();
  const synthetic::Truth plain;
  const double exact[] = {plain.R_a, plain.K_b, plain.K_m, plain.B, plain.J};
  for (std::size_t i = 0; i < truth.base.size(); ++i) truth.base[i].value = exact[i];
  truth.noise = {{Signal::omega, 0.1}, {Signal::i_a, 0.01}, {Signal::e_a, 1e-3}, {Signal::torque, 1e-3}};
  for (const double rho : {0.0, 0.97}) {
    std::vector<synthetic::Hold> plan{{0.5, 0}};
    for (int k = 0; k < 8; ++k) plan.push_back({2, k % 2 == 0 ? 3.0 : -4.0});
    emtb::Run run = synthetic::record(braked, plan, 1e-3, {.omega = 0.1, .i_a = 0.01, .e_a = 1e-3});
    Series torque = run.at(Signal::omega);
    const std::vector<double> noise = synthetic::coloured(torque.t.size(), rho, 5);
    for (std::size_t k = 0; k < noise.size(); ++k) torque.value.edit()[k] = 4e-5 * torque.value[k] + 1e-3 * noise[k];
    run.signals[Signal::torque] = torque;
    const std::vector<Record> records = prepare(std::vector{run}, {}, truth).train;
    ASSERT_TRUE(records[0].measured_load);
    const auto mean = mean_squares(residuals(records, truth, truth.values(), {}));
    EXPECT_NEAR(mean.at(Signal::omega), 1, 0.45) << rho;
    EXPECT_NEAR(mean.at(Signal::i_a), 1, 0.4) << rho;
  }
}

/// A shaft that speeds up, its angle counted in steps.
emtb::Run counted_run(double step, double seconds) {
  emtb::Run run;
  run.name = "counted";
  run.signals[Signal::u_ref] = series(0.02, seconds, [](double) { return 2.0; });
  run.signals[Signal::theta] =
      series(0.02, seconds, [step](double t) { return step * std::floor((40 * t + 5 * t * t) / step); });
  return run;
}

TEST(NoiseFloor, OfAnEncoderWhoseStepOneRunTellsIsThatOfItsCountsInAll) {
  constexpr double step = 2 * std::numbers::pi / 1731;
  std::vector<emtb::Run> runs{counted_run(step, 6), counted_run(step, 2)};
  runs.front().signals.at(Signal::theta).lsb = step;
  EXPECT_EQ(prepare(runs, {}, servo_model()).noise.at(Signal::omega).from, FloorSource::counts);
  EXPECT_EQ(prepare({runs.data(), 1}, {&runs[1], 1}, servo_model()).noise.at(Signal::omega).from, FloorSource::counts);
  for (double& angle : runs.back().signals.at(Signal::theta).value.edit()) angle *= 1.001;  // another instrument
  EXPECT_NE(prepare(runs, {}, servo_model()).noise.at(Signal::omega).from, FloorSource::counts);
}

}  // namespace
}  // namespace emtb
