#include "session/unwind.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace emtb {
namespace {

constexpr double turn = 2 * std::numbers::pi;

/// A shaft that runs up to a speed, back through rest to the other, in rows of 10 ms.
Run turning(double speed) {
  Series theta;
  double angle = 0.5;
  for (int k = 0; k < 600; ++k) {
    theta.t.push_back(0.01 * k);
    theta.value.push_back(angle);
    angle += 0.01 * speed * std::sin(0.02 * k);
  }
  return {.name = "turning", .signals = {{Signal::theta, theta}}};
}

Run within(Run run, double period) {
  for (double& angle : run.signals.at(Signal::theta).value.edit()) angle -= period * std::floor(angle / period);
  return run;
}

void expect_the_same_motion(const Run& run, const Run& as_it_was) {
  const auto &a = run.at(Signal::theta).value, &b = as_it_was.at(Signal::theta).value;
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k] - a[0], b[k] - b[0], 1e-9) << "row " << k;
}

TEST(Unwind, PutsTogetherAnAngleThatBeginsAnewWithEachTurn) {
  for (const double speed : {30.0, 200.0, 500.0}) {  // up to 5 rad from row to row
    const emtb::Run as_it_was = turning(speed);
    emtb::Run run = within(as_it_was, turn);
    unwind_angles(std::span(&run, 1));
    expect_the_same_motion(run, as_it_was);
    EXPECT_DOUBLE_EQ(run.at(Signal::theta).begins_anew_after, turn) << speed;
  }
}

TEST(Unwind, PutsTogetherACounterWhoseBitsEnd) {
  const double step = turn / 1320;
  const emtb::Run as_it_was = turning(800);
  emtb::Run run = within(as_it_was, 4096 * step);
  run.signals.at(Signal::theta).lsb = step;
  unwind_angles(std::span(&run, 1));
  expect_the_same_motion(run, as_it_was);
}

TEST(Unwind, GoesByTheSpeedBesideItWhereTheShaftTurnsUnevenly) {
  emtb::Run as_it_was = turning(0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(-600, 600);
  Series& theta = as_it_was.signals.at(Signal::theta);
  Series& omega = as_it_was.signals[Signal::omega];
  omega.t = theta.t;
  omega.value = {0};
  for (std::size_t k = 1; k < theta.t.size(); ++k) {
    omega.value.push_back(draw(random));
    theta.value.edit()[k] = theta.value[k - 1] + 0.005 * (omega.value[k - 1] + omega.value[k]);
  }
  emtb::Run run = within(as_it_was, turn);
  unwind_angles(std::span(&run, 1));
  expect_the_same_motion(run, as_it_was);
}

TEST(Unwind, LeavesAnAngleThatNeverJumps) {
  const emtb::Run as_it_was = turning(30);
  emtb::Run run = as_it_was;
  unwind_angles(std::span(&run, 1));
  EXPECT_EQ(run.at(Signal::theta).value, as_it_was.at(Signal::theta).value);
  EXPECT_EQ(run.at(Signal::theta).begins_anew_after, 0);
}

TEST(Unwind, LeavesAnAngleWhoseCourseNothingTells) {
  emtb::Run run = turning(0);
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(0, turn);
  for (double& angle : run.signals.at(Signal::theta).value.edit()) angle = draw(random);
  const std::vector<double> as_read = run.at(Signal::theta).value;
  unwind_angles(std::span(&run, 1));
  EXPECT_EQ(run.at(Signal::theta).value, as_read);
}

TEST(Unwind, LeavesASpike) {
  emtb::Run run = turning(30);
  run.signals.at(Signal::theta).value.edit()[300] += 100;
  const std::vector<double> as_read = run.at(Signal::theta).value;
  unwind_angles(std::span(&run, 1));
  EXPECT_EQ(run.at(Signal::theta).value, as_read);
}

}  // namespace
}  // namespace emtb
