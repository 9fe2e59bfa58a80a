#include "estimate/noise.h"

#include <gmock/gmock.h>

#include <cmath>

#include "tests/estimate/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using synthetic::servo_model;

/// A run of constant references, 4 s each, and a speed that has settled but for its noise.
PreparedRun settled_run(const std::vector<double>& noise, double lsb = 0) {
  emtb::Run run;
  run.name = "settled";
  const double interval = 1e-3, seconds = static_cast<double>(noise.size()) * interval;
  run.signals[Signal::u_ref] = series(interval, seconds, [](double t) { return 1 + std::floor(t / 4); });
  Series omega = run.at(Signal::u_ref);
  for (std::size_t k = 0; k < omega.value.size(); ++k) omega.value[k] = 80 * omega.value[k] + noise[k];
  omega.lsb = lsb;
  run.signals[Signal::omega] = omega;
  return prepare_run(run, servo_model());
}

NoiseFloor floor_of_omega(const PreparedRun& run, const Model& model = servo_model()) {
  return estimate_noise(std::span(&run, 1), model).at(Signal::omega);
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
    EXPECT_EQ(floor.from, "settled");
    EXPECT_FALSE(floor.lower_bound);
  }
}

TEST(NoiseFloor, ASlowDriftIsNotNoise) {
  std::vector<double> noise = scaled(synthetic::coloured(24'000, 0, 3), 0.1);
  for (std::size_t k = 0; k < noise.size(); ++k) noise[k] += 2e-4 * static_cast<double>(k);  // 0.2 rad/s2: it warms up
  EXPECT_NEAR(floor_of_omega(settled_run(noise)).sigma, 0.1, 0.01);
}

TEST(NoiseFloor, WhatTheModelDeclaresWins) {
  const PreparedRun run = settled_run(scaled(synthetic::coloured(24'000, 0, 3), 0.1), 0.5);
  Model model = servo_model();
  model.noise[Signal::omega] = 0.7;
  EXPECT_EQ(floor_of_omega(run, model).sigma, 0.7);
  EXPECT_EQ(floor_of_omega(run, model).from, "declared");
  model.noise[Signal::omega] = 0.01;
  EXPECT_NEAR(floor_of_omega(run, model).sigma, 0.5 / std::sqrt(12.0), 1e-12)
      << "but no instrument is better than its steps";
}

TEST(NoiseFloor, IsNeverBelowTheResolution) {
  const NoiseFloor floor = floor_of_omega(settled_run(std::vector<double>(24'000, 0.0), 0.6));
  EXPECT_NEAR(floor.sigma, 0.6 / std::sqrt(12.0), 1e-12);
  EXPECT_EQ(floor.from, "resolution");
}

TEST(NoiseFloor, FromDifferencesIsFlaggedAsALowerBound) {
  emtb::Run run;
  run.name = "ramp";
  run.signals[Signal::u_ref] = series(1e-3, 8, [](double t) { return 0.5 * t; });  // never settles
  synthetic::Noise noise(5);
  run.signals[Signal::omega] = series(1e-3, 8, [&](double t) { return 40 * t + noise(0.2); });
  const PreparedRun prepared = prepare_run(run, servo_model());
  const NoiseFloor floor = floor_of_omega(prepared);
  EXPECT_EQ(floor.from, "differences");
  EXPECT_TRUE(floor.lower_bound);
  EXPECT_NEAR(floor.sigma, 0.2, 0.02);  // white: as it should be
}

TEST(DifferenceScatter, SeesNoiseBehindEdgesAndNoneInAReference) {
  synthetic::Noise noise(2);
  const Series edges = series(1e-3, 5, [&](double t) { return 10 * std::floor(t) + noise(0.3); });
  EXPECT_NEAR(difference_scatter(edges.value), 0.3, 0.02);
  const Series reference = series(1e-3, 5, [](double t) { return std::floor(t); });
  EXPECT_EQ(difference_scatter(reference.value), 0);
  EXPECT_EQ(difference_scatter(std::vector<double>{1}), 0);
}

TEST(Weigh, WidensTheVoltageWhereItsEdgesAreAndNowhereElse) {
  emtb::Run run = synthetic::record({}, {{1, 0}, {1.5, 2}}, 1e-3, {.e_a = 0.05});
  std::vector<PreparedRun> records{prepare_run(run, servo_model())};
  Model model = servo_model();
  model.noise = {{Signal::omega, 0.1}, {Signal::i_a, 0.01}, {Signal::e_a, 0.05}};
  weigh(records, estimate_noise(records, model), model);
  const auto e_a = std::ranges::find(records[0].observations, Signal::e_a, &Observation::signal);
  EXPECT_EQ(e_a->sigma[500], 0.05);
  EXPECT_GT(e_a->sigma[1002], 1);  // 2 V a sample, which half a sample of timing may shift
  EXPECT_EQ(e_a->sigma[1500], 0.05);
  const auto omega = std::ranges::find(records[0].observations, Signal::omega, &Observation::signal);
  for (const double sigma : omega->sigma) ASSERT_EQ(sigma, 0.1);
}

}  // namespace
}  // namespace emtb
