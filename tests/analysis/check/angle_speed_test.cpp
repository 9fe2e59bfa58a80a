#include "analysis/check/angle_speed.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>

#include "analysis/check/held.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::Field;
using testing::IsEmpty;

constexpr double count = 2 * std::numbers::pi / 4096;  // [rad]

double speed_at(double t) {
  return t < 1 ? 0 : t < 3 ? -8 * (1 - std::exp(-(t - 1) / 0.2)) : -8 * std::exp(-(t - 3) / 0.2);
}

double angle_at(double t) {
  const auto run_up = [](double since) { return 8 * (since - 0.2 * (1 - std::exp(-since / 0.2))); };
  return t < 1 ? 0 : t < 3 ? -run_up(t - 1) : -run_up(t - 1) + run_up(t - 3);
}

/// A shaft that rests, turns, and rests again; the speed is read with a factor and an offset.
emtb::Run turned(double factor, double offset) {
  emtb::Run run;
  run.name = "turned";
  synthetic::Noise noise(3);
  run.signals[Signal::u_ref] = synthetic::series(4e-3, 6, [](double t) { return t > 1 && t < 3 ? -4.0 : 0.0; });
  run.signals[Signal::theta] =
      synthetic::series(4e-3, 6, [&](double t) { return count * std::floor(angle_at(t) / count); });
  run.signals[Signal::theta].lsb = count;
  run.signals[Signal::omega] =
      synthetic::series(4e-3, 6, [&](double t) { return factor * speed_at(t) + offset + noise(0.01); });
  return run;
}

const auto a_scale = ElementsAre(Field("what", &DataFinding::what, Flaw::scale));

TEST(AngleAgainstSpeed, AnOffsetOfTheSpeedIsNoGearBetweenThem) {
  EXPECT_THAT(angle_against_speed(turned(1, 0)), IsEmpty());
  EXPECT_THAT(angle_against_speed(turned(1, 1.5)), IsEmpty());
  EXPECT_THAT(angle_against_speed(turned(1, -1.5)), IsEmpty());
  EXPECT_THAT(angle_against_speed(turned(1.25, 0)), a_scale);
  EXPECT_THAT(angle_against_speed(turned(1.25, 0.3)), a_scale);
}

TEST(AngleAgainstSpeed, TellsWhatTheSpeedReadsAtRest) {
  EXPECT_NEAR(speed_read_at_rest(turned(1, 1.5)), 1.5, 0.02);
  EXPECT_NEAR(speed_read_at_rest(turned(1, 0)), 0, 0.02);
}

TEST(AngleAgainstSpeed, AnAngleThatStandsIsNotHeldWhereTheSpeedReadsAsMuchAtRest) {
  EXPECT_THAT(held(turned(1, 1.5)), IsEmpty());
  emtb::Run stuck = turned(1, 1.5);
  std::span<double> theta = stuck.signals.at(Signal::theta).value.edit();
  std::fill(theta.begin() + 400, theta.begin() + 500, theta[400]);
  EXPECT_THAT(held(stuck), ElementsAre(Field("signal", &DataFinding::signal, Signal::theta)));
}

}  // namespace
}  // namespace emtb
