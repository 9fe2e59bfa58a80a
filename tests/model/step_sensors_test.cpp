#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "tests/model/step_bench.h"

namespace emtb {
namespace {

// What sensors make of the motion, and what repeats with the angle.

using namespace step_bench;

TEST(Step, ATachoLagTrailsARampExactly) {
  const double tau = 0.02, slope = K * 0.5 / J;
  const Excitation x = constant(0.3, 1e-3, 0.5, &Excitation::i_a);
  const Trajectory<double> y = run(with({"tacho_lag"}, Signal::i_a), and_({R, K, K, 0, J}, {tau}), x);
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    ASSERT_NEAR(y.omega[k], slope * (x.t[k] - tau * (1 - std::exp(-x.t[k] / tau))), 1e-9);
  }
}

TEST(Step, ATachoLagChangesTheReadingAndNotTheMotor) {
  const Excitation x = holds(1e-3, {{0.1, 1}, {0.2, 5}});
  const Trajectory<double> without = run(with({}), servo, x),
                           with_lag = run(with({"tacho_lag"}), and_(servo, {0.02}), x);
  EXPECT_EQ(without.i_a, with_lag.i_a);
  EXPECT_NEAR(without.theta.back(), with_lag.theta.back(), 1e-12 * without.theta.back());
  EXPECT_LT(with_lag.omega[120], without.omega[120]);
}

TEST(Step, ACurrentReadAtTheSupplyIsTheShareOfTheTimeThatTheBridgeIsOn) {
  const Excitation x = holds(1e-3, {{0.1, 3}, {0.2, 6}, {0.1, -9}});
  const Trajectory<double> motor = run(with({}), servo, x),
                           supply = run(with({"supply_current"}), and_(servo, {12}), x);
  EXPECT_EQ(motor.omega, supply.omega);
  EXPECT_NEAR(supply.i_a[90], 0.25 * motor.i_a[90], 1e-12);
  EXPECT_NEAR(supply.i_a[290], 0.5 * motor.i_a[290], 1e-12);
  EXPECT_NEAR(supply.i_a[390], 0.75 * motor.i_a[390], 1e-12);
}

TEST(Step, ACurrentReadAtTheSupplyGoesWithTheVoltageThatWasMeasured) {
  Excitation x = constant(0.2, 1e-3, 6, &Excitation::e_a);
  ModelStructure structure = with({"supply_current"}, Signal::e_a);
  structure.measured_voltage = true;
  ModelStructure plain = with({}, Signal::e_a);
  plain.measured_voltage = true;
  const Trajectory<double> motor = run(plain, servo, x), supply = run(structure, and_(servo, {12}), x);
  ASSERT_GT(motor.i_a[100], 0);
  EXPECT_NEAR(supply.i_a[100], 0.5 * motor.i_a[100], 1e-12);
}

TEST(Step, ALateSpeedIsThatOfBeforeAndTheMotorIsAsItWas) {
  const double t_d = 0.0123;
  const Excitation x = holds(1e-3, {{0.1, 1}, {0.2, 5}});
  const Trajectory<double> now = run(with({}), servo, x), late = run(with({"speed_delay"}), and_(servo, {t_d}), x);
  EXPECT_EQ(late.i_a, now.i_a);
  for (std::size_t k = 13; k < x.t.size(); ++k) {  // 0.3 of a reading later than 13 readings before
    EXPECT_NEAR(late.omega[k], 0.3 * now.omega[k - 13] + 0.7 * now.omega[k - 12], 1e-9) << k;
    EXPECT_NEAR(late.theta[k], 0.3 * now.theta[k - 13] + 0.7 * now.theta[k - 12], 1e-9) << k;
  }
  EXPECT_EQ(late.omega[5], 0) << "as it stood before the start";
}

TEST(Step, ALateSpeedThatStartsInMotionMovedBefore) {
  Excitation x = constant(0.1, 1e-3, 0, &Excitation::i_a);
  x.initial.omega = 20;
  x.initial.theta = 1;
  const Trajectory<double> y = run(with({"speed_delay"}, Signal::i_a), and_({R, K, K, 0, J}, {0.02}), x);
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    ASSERT_NEAR(y.omega[k], 20, 1e-9);
    ASSERT_NEAR(y.theta[k], 1 + 20 * (x.t[k] - 0.02), 1e-9);
  }
}

TEST(Step, TachoRippleRepeatsWithTheAngleInProportionToTheSpeed) {
  Excitation x = constant(1, 1e-3, 12, &Excitation::u_ref);
  const Trajectory<double> even = run(with({}), servo, x);
  const Trajectory<double> y = run(with({"tacho_ripple"}), and_(servo, {0.02, 2, 0.5}), x);
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    EXPECT_NEAR(y.omega[k], even.omega[k] * (1 + 0.02 * std::sin(2 * even.theta[k] + 0.5)), 1e-9);
  }
  EXPECT_EQ(y.i_a, even.i_a);
  // Where the angle is measured, that counts, and not the model's own.
  for (const double t : x.t) x.angle.push_back(100 * t);
  const Trajectory<double> measured = run(with({"tacho_ripple"}), and_(servo, {0.02, 2, 0.5}), x);
  for (std::size_t k = 1; k < x.t.size(); ++k) {
    EXPECT_NEAR(measured.omega[k], even.omega[k] * (1 + 0.02 * std::sin(200 * x.t[k] + 0.5)), 1e-9);
  }
}

TEST(Step, TeethThatPassWithinAStepPullByTheirMean) {
  // At full speed a tooth passes in 1.4 ms: single points of steps of 1 ms would make a slow torque of it.
  Excitation coarse = constant(0.6, 1e-3, 10, &Excitation::u_ref), fine = coarse;
  fine.longest_step = 2e-5;
  const std::vector<double> teeth = and_(servo, {0.02, 20, 0.5});
  const Trajectory<double> exact = run(with({"cogging"}), teeth, fine), quick = run(with({"cogging"}), teeth, coarse);
  ASSERT_GT(exact.omega.back(), 200);
  EXPECT_LT(largest_error(quick.omega, exact.omega), 0.05);  // [rad/s]
}

TEST(Step, WhatALagAndAnOffsetDoToAnAngleThatIsIntegratedFromTheirReadingIsTakenOut) {
  Excitation x = constant(1, 1e-3, 2, &Excitation::u_ref);
  for (std::size_t k = 500; k < x.t.size(); ++k) x.u_ref.edit()[k] = -1;
  const auto run_with = [&](const Excitation& e) {
    return run(with({"cogging", "tacho_ripple", "tacho_lag", "tacho_offset"}),
               and_(servo, {0.004, 6, 0.3, 0.002, 2, 0.1, 0.02, 1.5}), e);
  };
  const Trajectory<double> truth = run_with(x);
  double angle = 0;  // of the reading: 0.02 s and 1.5 rad/s put it off by up to 2 rad
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    if (k > 0) angle += 0.5e-3 * (truth.omega[k - 1] + truth.omega[k]);
    x.angle.push_back(angle);
  }
  EXPECT_GT(largest_error(run_with(x).omega, truth.omega), 0.5) << "where the angle counts as measured by itself";
  x.angle_integrated = true;
  EXPECT_LT(largest_error(run_with(x).omega, truth.omega), 0.1);  // [rad/s] what a step late makes
}

TEST(Step, NoiseOfAMeasuredAngleDoesNotTurnARotorThatStandsAndMovesOneThatTurns) {
  const std::vector<double> cogging{0.01, 6, 0};  // [N m], [1/turn], [rad]: a well at 0
  Excitation x = constant(2, 1e-3, 0, &Excitation::u_ref);
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    if (k > 1000) x.u_ref.edit()[k] = 12;
  }
  const auto run_with = [&](const Excitation& e) { return run(with({"cogging"}), and_(servo, cogging), e); };
  const Trajectory<double> truth = run_with(x);
  for (std::size_t k = 0; k < x.t.size(); ++k) x.angle.push_back(truth.theta[k] + 0.2 * x.t[k]);  // [rad] it drifts
  EXPECT_GT(std::abs(run_with(x).omega[1000]), 0.1) << "where the measured angle counts, the well moves";
  x.angle_pull.assign(x.t.size(), 0);
  const Trajectory<double> free = run_with(x);
  for (std::size_t k = 0; k <= 1000; ++k) EXPECT_NEAR(free.omega[k], 0, 1e-12);
  for (std::size_t k = 1000; k < x.t.size(); ++k) x.angle_pull.edit()[k] = 100;
  const Trajectory<double> pulled = run_with(x);
  Excitation there = x;  // the rotor as far on as measured, from where it turns
  there.angle_pull.clear();
  const Trajectory<double> measured = run_with(there);
  EXPECT_NEAR(pulled.omega.back(), measured.omega.back(), 0.05);
}

}  // namespace
}  // namespace emtb
