#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "tests/model/step_bench.h"

namespace emtb {
namespace {

// What is measured upstream drives what is simulated downstream.

using namespace step_bench;

TEST(Step, TheMotorFollowsTheMeasuredVoltageAndTheDriverPredictsItsOwn) {
  ModelStructure s = with({});
  s.driver = {.gain = 4, .rise = 100, .fall = 100, .min = -24, .max = 24};
  Excitation x = holds(1e-3, {{0.2, 0}, {0.5, 3}});
  const Trajectory<double> chained = run(s, servo, x);
  x.e_a.assign(x.t.size(), 6);
  s.measured_voltage = true;
  const Trajectory<double> staged = run(s, servo, x);
  EXPECT_EQ(staged.e_a, chained.e_a);  // the driver does not care what the motor gets
  const Trajectory<double> motor = run(with({}), servo, constant(0.7, 1e-3, 6, &Excitation::u_ref));
  EXPECT_LT(largest_error(staged.omega, motor.omega), 1e-9);
}

TEST(Step, NoiseOfTheMeasuredVoltageDoesNotDriveAMotorWhoseDriverBlocks) {
  ModelStructure s = with({"one_quadrant_driver"});
  s.driver = {.gain = 10, .rise = 1e3, .fall = 1e3, .min = -100, .max = 100};
  Excitation x = holds(1e-3, {{0.5, 1}, {0.5, 0}});
  const Trajectory<double> quiet = run(s, servo, x);
  s.measured_voltage = true;
  for (std::size_t k = 0; k < x.t.size(); ++k) x.e_a.push_back(quiet.e_a[k] + (k % 2 == 0 ? 0.2 : -0.2));
  const Trajectory<double> y = run(s, servo, x);
  EXPECT_GT(y.omega.back(), 50);  // it coasts
  EXPECT_LT(largest_error(y.omega, quiet.omega), 0.02 * quiet.omega.back());
  for (std::size_t k = 550; k < x.t.size(); ++k) ASSERT_EQ(y.i_a[k], 0) << "at " << x.t[k] << " s";
}

TEST(Step, ADriverThatTakesNoneBackDoesSoBothWays) {
  for (const double L_a : {0.0, 2e-3}) {
    ModelStructure s = with({"one_quadrant_driver", "armature_inductance"});
    s.driver = {.gain = 10, .min = -100, .max = 100};
    const Excitation x = holds(1e-3, {{0.3, 1}, {0.3, 0.3}, {0.3, 0}, {0.3, -1}, {0.3, -0.3}, {0.3, 0}});
    const Trajectory<double> y = run(s, and_(servo, {L_a}), x);
    EXPECT_GT(y.omega[599], 0.9 * y.omega[299]) << "it coasts at less voltage";
    EXPECT_GT(y.omega[899], 0.9 * y.omega[599]) << "and at none";
    EXPECT_LT(y.omega[1199], -0.9 * y.omega[299]) << "the other way it is driven";
    EXPECT_LT(y.omega.back(), 0.9 * y.omega[1199]);
    for (std::size_t k = 310; k < 900; ++k) ASSERT_EQ(y.i_a[k], 0) << "at " << x.t[k] << " s, L_a " << L_a;
    for (std::size_t k = 910; k < x.t.size(); ++k) ASSERT_LE(y.i_a[k], 0) << "at " << x.t[k] << " s, L_a " << L_a;
  }
}

TEST(Step, WhatFlowsAgainstADriverThatTakesNoneBackDiesAtOnce) {
  for (const double L_a : {0.0, 2e-3}) {
    ModelStructure s = with({"one_quadrant_driver", "armature_inductance"});
    s.driver = {.gain = 10, .min = -100, .max = 100};
    // Driven, reversed for an instant, which brakes by the current of both voltages, and asked for a little or nothing.
    for (const double then : {0.3, 0.0}) {
      const Trajectory<double> y = run(s, and_(servo, {L_a}), holds(1e-3, {{0.3, 1}, {0.01, -1}, {0.3, then}}));
      ASSERT_LT(y.i_a[308], -1) << "L_a " << L_a;
      for (std::size_t k = 312; k < 610; ++k) ASSERT_GE(y.i_a[k], 0) << "at " << k << " ms, L_a " << L_a;
      EXPECT_GT(y.omega[609], 0.9 * std::min(y.omega[312], y.omega[299])) << "it coasts, L_a " << L_a;
    }
  }
}

TEST(Step, ADriverThatLetsGoAtZeroBrakesElsewhere) {
  for (const Signal input : {Signal::u_ref, Signal::e_a}) {
    ModelStructure s = with({"coasting_driver"}, input);
    s.driver = {.gain = 1, .min = -100, .max = 100};
    s.measured_voltage = input == Signal::e_a;
    Excitation x = holds(1e-3, {{0.3, 10}, {0.3, 3}, {0.3, 0}, {0.3, -10}, {0.3, 0}});
    if (input == Signal::e_a) x.e_a = std::exchange(x.u_ref, {}), x.e_a_held = true;
    const Trajectory<double> y = run(s, servo, x);
    EXPECT_NEAR(y.omega[599], 0.3 * y.omega[299], 0.02 * y.omega[299]) << "less voltage brakes";
    EXPECT_LT(y.i_a[305], 0);
    EXPECT_GT(y.omega[899], 0.9 * y.omega[599]) << "none lets go";
    EXPECT_LT(y.omega.back(), 0.9 * y.omega[1199]);
    for (std::size_t k = 602; k < 900; ++k) ASSERT_EQ(y.i_a[k], 0) << "at " << x.t[k] << " s";
  }
}

TEST(Step, AMeasuredVoltageIsLinearBetweenItsReadings) {
  // Two readings far apart are the same as many on the line between them.
  ModelStructure s = with({"armature_inductance"}, Signal::e_a);
  s.measured_voltage = true;
  Excitation coarse, fine;
  for (int k = 0; k <= 10; ++k) coarse.t.push_back(0.02 * k), coarse.e_a.push_back(3.0 * k * (k % 3));
  coarse.longest_step = 1e-3;
  for (int k = 0; k <= 200; ++k) {
    const int a = k / 20, b = std::min(a + 1, 10);
    fine.t.push_back(1e-3 * k);
    fine.e_a.push_back(coarse.e_a[static_cast<std::size_t>(a)] +
                       (coarse.e_a[static_cast<std::size_t>(b)] - coarse.e_a[static_cast<std::size_t>(a)]) * (k % 20) /
                           20.0);
  }
  const Trajectory<double> one = run(s, and_(servo, {1e-3}), coarse), other = run(s, and_(servo, {1e-3}), fine);
  for (std::size_t k = 0; k <= 10; ++k) {
    EXPECT_NEAR(one.omega[k], other.omega[20 * k], 1e-9);
    EXPECT_NEAR(one.i_a[k], other.i_a[20 * k], 1e-9);
  }
}

TEST(Step, AMeasuredVoltageGoesOnAsTheDriverDoesWhereAnEffectShapesItsEdges) {
  // Rows as long as the edges: between two readings of the terminals the voltage is in no straight line.
  const std::vector<std::pair<ModelStructure, std::vector<double>>> drivers{
      {with({"driver_lag"}), {0.004}}, {with({"driver_delay"}), {0.003}}, {with({"driver_slew"}), {1500, 1500}}};
  for (auto [s, effect] : drivers) {
    s.driver = {.gain = 2, .min = -24, .max = 24};
    for (const double acts_after : {0.0, -1e-5, 2e-3}) {
      Excitation x = holds(5e-3, {{0.1, 0}, {0.1, 4}, {0.1, -3}, {0.1, 1}});
      x.acts_after = acts_after;
      s.measured_voltage = false;
      const Trajectory<double> motor = run(s, and_(servo, effect), x);
      for (const double e : motor.e_a) x.e_a.push_back(e + 0.5);  // the driver is off by an offset
      s.measured_voltage = true;
      const Trajectory<double> measured = run(s, and_(servo, effect), x);
      Excitation offset = x;
      offset.e_a.clear();
      ModelStructure exact = s;
      exact.measured_voltage = false;
      for (double& u : offset.u_ref.edit()) u += 0.25;
      const Trajectory<double> truth = run(exact, and_(servo, effect), offset);
      EXPECT_LT(largest_error(measured.omega, truth.omega), 0.01 * 24) << acts_after << " s, " << effect.front();
    }
  }
}

TEST(Step, AMeasuredVoltageHasItsEdgesWhereTheDriverHasThemAlsoWithinLongRows) {
  ModelStructure s = with({});
  s.driver = {.gain = 2, .min = -24, .max = 24};
  for (const double acts_after : {0.0, -2e-5, 8e-3}) {
    Excitation x = holds(0.02, {{0.2, 0}, {0.2, 4}, {0.2, -3}, {0.2, 1}});
    x.acts_after = acts_after;
    x.longest_step = 2e-3;
    s.measured_voltage = false;
    const Trajectory<double> truth = run(s, servo, x);
    x.e_a = truth.e_a;
    s.measured_voltage = true;
    EXPECT_LT(largest_error(run(s, servo, x).omega, truth.omega), 1e-6) << acts_after;
  }
}

TEST(Step, AMeasuredLoadBrakesHoldsAndNeverReversesTheShaft) {
  ModelStructure s = with({}, Signal::i_a);
  s.measured_load = true;
  Excitation x = constant(1, 1e-3, 0, &Excitation::i_a);
  x.initial.omega = 20;
  x.load.assign(x.t.size(), 0.003);
  const Trajectory<double> y = run(s, {R, K, K, 0, J}, x);
  EXPECT_NEAR(y.omega[200], 20 - 0.003 / J * 0.2, 1e-9);
  for (std::size_t k = 402; k < y.omega.size(); ++k) ASSERT_EQ(y.omega[k], 0) << "a brake does not push";
  x.initial.omega = -20;
  for (double& load : x.load.edit()) load = -0.003;
  EXPECT_EQ(run(s, {R, K, K, 0, J}, x).omega.back(), 0);
}

TEST(Step, AMeasuredLoadAlongTheMotionDrives) {
  ModelStructure s = with({}, Signal::i_a);
  s.measured_load = true;
  Excitation x = constant(0.5, 1e-3, 0, &Excitation::i_a);
  x.initial.omega = 20;
  x.load.assign(x.t.size(), -0.003);
  EXPECT_NEAR(run(s, {R, K, K, 0, J}, x).omega.back(), 20 + 0.003 / J * x.t.back(), 1e-9);
}

TEST(Step, WhereTheLoadIsMeasuredLoadEffectsOnlyPredictIt) {
  ModelStructure s = with({"load_torque"}, Signal::i_a);
  s.measured_load = true;
  Excitation x = constant(0.5, 1e-3, 0.2, &Excitation::i_a);
  x.load.assign(x.t.size(), 0.002);
  const Trajectory<double> y = run(s, and_({R, K, K, 0, J}, {0.5}), x);
  EXPECT_NEAR(y.omega.back(), (K * 0.2 - 0.002) / J * x.t.back(), 1e-9);
  for (const double torque : y.torque) ASSERT_EQ(torque, 0.5);  // from the first reading on
}

TEST(Step, AMeasuredWeightPullsTheShaftBackAsItsEffectSays) {
  ModelStructure s = with({"load_torque"}, Signal::i_a);
  s.measured_load = true;
  Excitation x = constant(0.5, 1e-3, 0, &Excitation::i_a);
  x.load.assign(x.t.size(), 0.002);
  EXPECT_EQ(run(s, and_({R, K, K, 0, J}, {0}), x).omega.back(), 0) << "a brake, for all that anybody knows";
  EXPECT_NEAR(run(s, and_({R, K, K, 0, J}, {0.002}), x).omega.back(), -0.002 / J * x.t.back(), 1e-9);
}

TEST(Step, AnOffsetOfTheGaugeIsNoLoad) {
  ModelStructure s = with({"load_torque", "torque_offset"}, Signal::i_a);
  s.measured_load = true;
  Excitation x = constant(0.5, 1e-3, 0.2, &Excitation::i_a);
  x.load.assign(x.t.size(), 0.003);  // 0.002 of load, as a gauge reads it that is 0.001 too high
  const Trajectory<double> y = run(s, and_({R, K, K, 0, J}, {0.002, 0.001}), x);
  EXPECT_NEAR(y.omega.back(), (K * 0.2 - 0.002) / J * x.t.back(), 1e-9);
  for (const double torque : y.torque) ASSERT_EQ(torque, 0.003);
}

TEST(Step, AnOffsetOfTheGaugeHoldsNoShaft) {
  ModelStructure s = with({"torque_offset"}, Signal::i_a);
  s.measured_load = true;
  for (const double current : {0.2, -0.2}) {  // [A] less than the offset would brake
    Excitation x = constant(0.5, 1e-3, current, &Excitation::i_a);
    x.load.assign(x.t.size(), 0.02);
    const Trajectory<double> y = run(s, and_({R, K, K, 0, J}, {0.02}), x);
    EXPECT_NEAR(y.omega.back(), K * current / J * x.t.back(), 1e-9);
  }
}

TEST(Step, WhatLoadEffectsForetellIsOnTheShaftBeforeALateGaugeReadsIt) {
  ModelStructure s = with({"eddy_brake", "torque_lag"}, Signal::i_a);
  const double tau = 0.04, T_b = 0.003, omega_b = 30;
  Excitation x = constant(0.5, 1e-3, 0.2, &Excitation::i_a);
  const Trajectory<double> truth = run(s, and_({R, K, K, 0, J}, {T_b, omega_b, tau}), x);
  s.measured_load = true;
  x.load = truth.torque;  // as the gauge reads it
  x.omega = truth.omega;
  const Trajectory<double> y = run(s, and_({R, K, K, 0, J}, {T_b, omega_b, tau}), x);
  const Trajectory<double> late = run(s, and_({R, K, K, 0, J}, {T_b, omega_b, 0}), x);
  EXPECT_NEAR(y.omega.back(), truth.omega.back(), 0.05);
  EXPECT_GT(late.omega.back(), truth.omega.back() + 0.5) << "what the gauge did not show in time would be missing";
}

TEST(Step, ADryBrakeForetellsWhatTheGaugeReadsAndTheGaugeBrakesTheShaft) {
  const double T_c = 0.002, T_b = 0.004;
  ModelStructure s = with({"coulomb_friction", "dry_brake"});
  s.driver = {.gain = 4, .rise = 50, .fall = 50, .min = -24, .max = 24};
  const Excitation chained = holds(1e-3, {{0.3, 0}, {0.8, 3}, {1.0, -2}, {0.5, 0}});
  const Trajectory<double> truth = run(s, and_(servo, {T_c, T_b}), chained);
  Excitation x = chained;
  x.load = truth.torque;
  x.omega = truth.omega;
  s.measured_load = true;
  const Trajectory<double> y = run(s, and_(servo, {T_c, 1.5 * T_b}), x);
  EXPECT_LT(largest_error(y.omega, truth.omega), 0.2) << "the gauge's torque is on the shaft, whatever the model says";
  EXPECT_EQ(y.torque[1000], 1.5 * T_b);
  EXPECT_EQ(y.torque[1900], -1.5 * T_b);
  EXPECT_EQ(y.torque.back(), 0) << "at rest without a current it takes nothing";
}

TEST(Step, TheGaugeReadsWhatTheLoadTakesThenNotHalfAStepBefore) {
  const double T_e = 0.003, phase = 0.4, T_b = 0.002, omega_b = 100;
  const Excitation x = constant(1, 1e-3, 0.4, &Excitation::i_a);
  const Trajectory<double> y =
      run(with({"eccentric_load", "eddy_brake"}, Signal::i_a), and_({R, K, K, 0, J}, {T_e, phase, T_b, omega_b}), x);
  ASSERT_GT(y.omega.back(), 200) << "0.1 rad in half a step";
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    const double share = y.omega[k] / omega_b;
    ASSERT_NEAR(y.torque[k], T_e * std::sin(y.theta[k] + phase) + 2 * T_b * share / (1 + share * share), 1e-12);
  }
}

TEST(Step, ASpringSwingsTheShaftAsHookeSays) {
  const double k = 0.02, T_0 = 0.004, current = 0.3, omega_n = std::sqrt(k / J);
  const Excitation x = constant(current, 1e-4, 0.3, &Excitation::i_a);
  const Trajectory<double> y = run(with({"spring_load"}, Signal::i_a), and_({R, K, K, 0, J}, {k, T_0}), x);
  const double held = (K * current - T_0) / k;  // [rad] where it would stay
  for (std::size_t n = 0; n < x.t.size(); ++n) {
    ASSERT_NEAR(y.theta[n], held * (1 - std::cos(omega_n * x.t[n])), 1e-3 * held) << x.t[n];
    ASSERT_NEAR(y.torque[n], T_0 + k * y.theta[n], 1e-12);
  }
}

TEST(Step, ASpringKnowsTheShaftsPlaceBetterThanAnAngleThatWanders) {
  const ModelStructure structure = with({"spring_load"}, Signal::i_a);
  const std::vector<double> p = and_({R, K, K, 0, J}, {0.02, 0.004});
  const Excitation unmeasured = constant(0.3, 1e-3, 0.3, &Excitation::i_a);
  Excitation wandering = unmeasured;
  wandering.angle = std::vector<double>(unmeasured.t.size(), 0.5);
  EXPECT_NE(run(structure, p, wandering).theta.back(), run(structure, p, unmeasured).theta.back())
      << "an encoder's angle is followed";
  wandering.angle_integrated = true;
  EXPECT_EQ(run(structure, p, wandering).omega.back(), run(structure, p, unmeasured).omega.back());
  EXPECT_EQ(run(structure, p, wandering).torque.back(), run(structure, p, unmeasured).torque.back());
}

}  // namespace
}  // namespace emtb
