#include "export/controller.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "export/closed_loop.h"
#include "hal/error.h"
#include "tests/export/models.h"

namespace emtb {
namespace {

/// The paper's motor behind a driver without limits.
Model behind_an_ideal_driver() {
  Model model = linear_model();
  model.driver.reset();
  return model;
}

TEST(Margins, OfALoopWhosePoleIsCancelledAreThoseOfItsDelayAlone) {
  // Kp + Ki/s over the motor's own pole leaves 2 pi f/s, late by 1.5 samples.
  const Model model = behind_an_ideal_driver();
  const LinearMachine motor = linearise(model, {.omega = 10});
  constexpr double f = 20, rate = 1000;
  const Gains g = gains_for(motor, {.speed_bandwidth = f, .current_bandwidth = 0, .rate = rate});
  const Margins m = margins_of(g, motor, Loop::direct, rate);
  EXPECT_NEAR(m.crossover, f, 0.01);
  EXPECT_NEAR(m.phase, 90 - 360 * f * 1.5 / rate, 0.1);
  // The phase turns where the delay takes 90 degrees: at rate/6.
  EXPECT_NEAR(m.gain, 20 * std::log10(rate / 6 / f), 0.1);
}

TEST(Margins, ShrinkWithWhatTheParametersLeaveOpen) {
  Model model = behind_an_ideal_driver();
  const WorkingPoint at{.omega = 10};
  const Gains g = gains_for(linearise(model, at), {.speed_bandwidth = 40});
  EXPECT_EQ(spread_of(model, at, g, Loop::cascade, 1000).draws, 0U) << "no standard errors, nothing to draw";
  model.at(base::J).std_error = 0.2 * model.at(base::J).value;
  const Spread spread = spread_of(model, at, g, Loop::cascade, 1000);
  const Margins nominal = margins_of(g, linearise(model, at), Loop::cascade, 1000);
  EXPECT_EQ(spread.draws, 200U);
  EXPECT_LT(spread.least.phase, nominal.phase - 2);
  EXPECT_LT(spread.least.gain, nominal.gain - 1);
}

TEST(StepAnswer, ReachesTheSpeedAsFastAsTheBandwidthSays) {
  const Model model = behind_an_ideal_driver();
  const LinearMachine motor = linearise(model, {.omega = 50});
  const Gains g = gains_for(motor, {.speed_bandwidth = 5});
  const StepAnswer a = step_answer(model, g, {.loop = Loop::direct, .feed_forward = false, .speed = 50, .duration = 2});
  EXPECT_NEAR(a.rise, std::log(9.0) / (2 * std::numbers::pi * 5), 2e-3) << "a first-order answer";
  EXPECT_LT(a.overshoot, 0.01);
  EXPECT_NEAR(a.left, 0, 0.01);
  EXPECT_EQ(a.limited, 0);
}

TEST(StepAnswer, TellsThatTheDriverIsAtItsLimits) {
  const Model model = linear_model();
  const Gains g = gains_for(linearise(model, {.omega = 80}), {.speed_bandwidth = 5});
  for (const Loop loop : {Loop::cascade, Loop::direct}) {
    const StepAnswer a = step_answer(model, g, {.loop = loop, .speed = 80, .duration = 12});
    EXPECT_GT(a.limited, 0.1) << "22.5 V/s";
    EXPECT_GT(a.rise, 1);
    EXPECT_NEAR(a.left, 0, 0.5) << "and gets there all the same";
  }
}

TEST(StepAnswer, FrictionIsOvercomeByItsFeedForward) {
  Model model = with(behind_an_ideal_driver(), "coulomb_friction");
  const LinearMachine motor = linearise(model, {.omega = 20});
  const Gains g = gains_for(motor, {.speed_bandwidth = 2});
  const auto answer = [&](bool ahead) {
    return step_answer(model, g, {.loop = Loop::direct, .feed_forward = ahead, .speed = 20, .duration = 4});
  };
  EXPECT_LT(answer(true).settled, answer(false).settled);
  const FeedForward f = feed_forward_of(model, 100);
  EXPECT_NEAR(f.i_a.front() * model.values()[base::K_m], braking_torque_at(model, f.omega.front()), 1e-9);
}

TEST(Gains, RefuseABandwidthThatTheRateCannotCarry) {
  const LinearMachine motor = linearise(behind_an_ideal_driver(), {.omega = 10});
  EXPECT_THROW(gains_for(motor, {.speed_bandwidth = 300}), ModelError);
  Model current_drive = behind_an_ideal_driver();
  current_drive.input = Signal::i_a;
  EXPECT_THROW(step_answer(current_drive, gains_for(motor, {}), {.speed = 1, .duration = 1}), ModelError);
}

}  // namespace
}  // namespace emtb
