#include "analysis/record/time_scatter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/record/angle_noise.h"
#include "analysis/record/observation.h"

namespace emtb {
namespace {

constexpr double one_count = 2 * std::numbers::pi / 2500;  // [rad]

/// An encoder on a shaft, and a logger that reads it at some times and writes others.
emtb::Run counts(std::span<const double> read, std::span<const double> written,
                 const std::function<double(double)>& angle) {
  emtb::Run run;
  Series& theta = run.signals[Signal::theta];
  for (std::size_t k = 0; k < read.size(); ++k) {
    theta.t.push_back(written[k]);
    theta.value.push_back(one_count * std::floor(angle(read[k]) / one_count));
  }
  theta.lsb = one_count;
  return run;
}

/// Times, one after another, that are late by up to so much.
std::vector<double> times(double apart, std::size_t n, double late = 0) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> lateness(0, 1);
  std::vector<double> t;
  for (std::size_t k = 0; k < n; ++k) t.push_back(static_cast<double>(k) * apart + late * lateness(random));
  return t;
}

std::vector<double> in_whole(double unit, std::vector<double> t) {
  for (double& at : t) at = unit * std::floor(at / unit);
  return t;
}

double scatter_of(const emtb::Run& run) { return time_scatter(std::span(&run, 1)); }

double steady(double t) { return 15.3 * t; }

/// From one level to the next in a tenth of a second.
double staircase(double t) {
  constexpr double level = 8, tau = 0.1;
  const double since = t - level * std::floor(t / level), step = std::floor(t / level);
  return 3 * level * step * (step + 1) / 2 + 3 * (step + 1) * since - 3 * tau * (1 - std::exp(-since / tau));
}

TEST(TimeScatter, OfALoggerThatWritesWholeMillisecondsIsThatOfTheDigitsLeftOut) {
  const std::vector<double> read = times(0.2, 500, 1e-3);
  for (const auto& motion : {steady, staircase}) {
    const double scatter = scatter_of(counts(read, in_whole(1e-3, read), motion));
    EXPECT_NEAR(scatter, 1e-3 / std::sqrt(12.0), 5e-5);
  }
}

TEST(TimeScatter, OfABusyComputerIsTheTimeFromItsStampToItsReading) {
  const std::vector<double> written = times(4e-3, 2000, 2e-3);
  std::vector<double> read = written;
  std::mt19937 random(9);
  std::uniform_real_distribution<double> lateness(0, 1.5e-3);
  for (double& at : read) at += lateness(random);
  EXPECT_NEAR(scatter_of(counts(read, written, steady)), 1.5e-3 / std::sqrt(12.0), 8e-5);
}

TEST(TimeScatter, IsNoneWhereTheTimesAreRight) {
  const std::vector<double> even = times(5e-3, 2000), uneven = times(5e-3, 2000, 2e-3);
  for (const double counts_a_reading : {2.0, 3.5, 3.9, 17.0, 120.25}) {
    const auto motion = [&](double t) { return counts_a_reading * one_count / 5e-3 * t; };
    EXPECT_EQ(scatter_of(counts(even, even, motion)), 0) << counts_a_reading;
    EXPECT_EQ(scatter_of(counts(uneven, uneven, motion)), 0) << counts_a_reading << ", uneven";
  }
  EXPECT_EQ(scatter_of(counts(even, even, staircase)), 0);
}

TEST(TimeScatter, IsNoRippleOfTheShaft) {
  const std::vector<double> t = times(1e-2, 2000);
  for (const double order : {1, 2, 6, 12}) {
    const auto motion = [&](double at) { return steady(at) + 0.05 / order * std::sin(order * steady(at)); };
    EXPECT_EQ(scatter_of(counts(t, t, motion)), 0) << order << " a turn";
  }
}

TEST(TimeScatter, IsNoMoreThanTheTimesCanBeOff) {
  const std::vector<double> read = times(0.2, 500, 0.02), even = times(0.2, 500);
  const double by_whole_seconds = scatter_of(counts(read, even, steady));
  EXPECT_NEAR(by_whole_seconds, 0.02 / std::sqrt(12.0), 1e-3) << "0.2, 0.4, ...: nothing tells a finer clock";
  std::vector<double> fine = even;
  for (double& at : fine) at += 0.0123;
  EXPECT_EQ(scatter_of(counts(read, fine, steady)), 1e-4) << "tenths of a millisecond are written";
}

TEST(TimeScatter, IsNotToldWhereTheShaftHardlyTurns) {
  const std::vector<double> read = times(5e-3, 2000, 1e-3);
  EXPECT_EQ(scatter_of(counts(read, in_whole(1e-3, read), [](double t) { return 0.1 * t; })), 0);
}

TEST(TimeScatter, IsInTheErrorOfTheSpeedThatIsMadeOfTheCounts) {
  const std::vector<double> read = times(0.2, 2000, 1e-3);
  const emtb::Run run = counts(read, in_whole(1e-3, read), steady);
  const Series& theta = run.at(Signal::theta);
  const Observation speed = speed_of_encoder(theta, theta.t, angle_noise(Model{}, std::span(&run, 1)));
  double seen = 0, foretold = 0;
  for (std::size_t i = 0; i < speed.size(); ++i) {
    seen += std::pow(speed.value[i] - 15.3, 2);
    foretold += speed.counted[i];
  }
  EXPECT_NEAR(std::sqrt(foretold / seen), 1, 0.15);
  EXPECT_GT(foretold, 4 * std::pow(one_count / 0.2, 2)) << "as far above that of the counts";
}

}  // namespace
}  // namespace emtb
