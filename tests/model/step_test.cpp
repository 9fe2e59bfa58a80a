#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "model/catalogue.h"
#include "model/simulation.h"
#include "tests/model/benches.h"
#include "tests/model/plain_machine.h"
#include "tests/model/reference.h"

namespace emtb {
namespace {

using testing::Each;
using testing_benches::holds;

// The small servo, round numbers.
constexpr double R = 1.2, K = 0.042, B = 1e-5, J = 6e-5;
const std::vector<double> servo{R, K, K, B, J};

ModelStructure with(const std::vector<std::string_view>& effects, Signal input = Signal::u_ref) {
  ModelStructure s;
  s.input = input;
  for (const std::string_view id : effects) s.effects.push_back(effect_index(id));
  return s;
}

std::vector<double> and_(std::vector<double> values, const std::vector<double>& more) {
  values.insert(values.end(), more.begin(), more.end());
  return values;
}

Trajectory<double> run(const ModelStructure& s, const std::vector<double>& values, const Excitation& x) {
  Trajectory<double> y;
  simulate<double>(s, values, x, y);
  return y;
}

/// A constant value of one input over a time.
Excitation constant(double seconds, double interval, double value, std::vector<double> Excitation::*input) {
  Excitation x = holds(interval, {{seconds, value}});
  x.longest_step = 1;
  std::vector<double> values = std::move(x.u_ref);
  x.u_ref.clear();
  x.*input = std::move(values);
  return x;
}

double largest_error(const std::vector<double>& a, const std::vector<double>& b) {
  double m = 0;
  for (std::size_t i = 0; i < a.size(); ++i) m = std::max(m, std::abs(a[i] - b[i]));
  return m;
}

// ---- against closed forms

TEST(Step, ConstantVoltageGivesTheFirstOrderResponse) {
  const double V = 12, gain = R * B + K * K, tau = J * R / gain;
  const auto error = [&](double h) {
    const Excitation x = constant(0.3, h, V, &Excitation::u_ref);
    const Trajectory<double> y = run(with({}), servo, x);
    std::vector<double> omega, i_a;
    for (const double t : x.t) {
      omega.push_back(K * V / gain * (1 - std::exp(-t / tau)));
      i_a.push_back((V - K * omega.back()) / R);
    }
    EXPECT_LT(largest_error(y.omega, omega), 0.1 * std::pow(h / tau, 4) * omega.back());
    EXPECT_LT(largest_error({y.i_a.begin() + 1, y.i_a.end()}, {i_a.begin() + 1, i_a.end()}),
              0.1 * std::pow(h / tau, 4) * i_a[1]);
    return largest_error(y.omega, omega);
  };
  EXPECT_NEAR(error(2e-3) / error(1e-3), 16, 0.4);  // fourth order
  EXPECT_NEAR(error(1e-3) / error(5e-4), 16, 0.4);
}

/// Both states of R, L, K_b, J, B under a constant voltage, from rest.
struct TwoStates {
  double L, V;

  std::array<double, 2> at(double t) const {  // i, omega
    // x' = A x + b; closed form through the eigenvalues of A.
    const double a11 = -R / L, a12 = -K / L, a21 = K / J, a22 = -B / J;
    const double half = 0.5 * (a11 + a22), root = std::sqrt(half * half - (a11 * a22 - a12 * a21));
    const double l1 = half + root, l2 = half - root;
    const double omega_end = K * V / (R * B + K * K), i_end = B * omega_end / K;
    // deviation d = x - x_end: exp(A t) d0 = (e1 (A - l2) - e2 (A - l1)) d0 / (l1 - l2)
    const double e1 = std::exp(l1 * t), e2 = std::exp(l2 * t);
    const auto mix = [&](double d, double ad) { return (e1 * (ad - l2 * d) - e2 * (ad - l1 * d)) / (l1 - l2); };
    const double di = -i_end, dw = -omega_end;
    return {i_end + mix(di, a11 * di + a12 * dw), omega_end + mix(dw, a21 * di + a22 * dw)};
  }
};

TEST(Step, InductanceGivesTheTwoStateResponse) {
  for (const double L : {2e-4, 2e-3}) {  // electrical time constants of 0.17 and 1.7 ms
    const TwoStates exact{L, 12};
    const auto error = [&](double h) {
      const Excitation x = constant(0.2, h, 12, &Excitation::u_ref);
      const Trajectory<double> y = run(with({"armature_inductance"}), and_(servo, {L}), x);
      std::vector<double> i_a, omega;
      for (const double t : x.t) {
        i_a.push_back(exact.at(t)[0]);
        omega.push_back(exact.at(t)[1]);
      }
      EXPECT_LT(largest_error(y.i_a, i_a), 0.03 * h / 1e-3) << L;  // of a peak of 9 A
      return largest_error(y.omega, omega);
    };
    EXPECT_LT(error(1e-3), 0.1) << L;  // of 285 rad/s
    if (L < 1e-3) continue;            // order shows once the step is below the electrical time constant
    EXPECT_NEAR(error(1e-3) / error(5e-4), 4, 0.4);
    EXPECT_NEAR(error(5e-4) / error(2.5e-4), 4, 0.4);
  }
}

TEST(Step, SlewLimitedDriverClimbsAStraightLineToItsTarget) {
  ModelStructure s = with({});
  s.driver = {.gain = 18.33, .rise = 22.5, .fall = 20.4, .min = 0, .max = 110};
  const Excitation x = holds(1e-3, {{1, 0}, {3, 2}, {9, 7}, {3, -1}});
  const Trajectory<double> y = run(s, {31.8, 0.67, 0.67, 1e-4, 3.4e-3}, x);
  const double falls_from = x.t[13000];
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    const double t = x.t[k];
    double e = 0;
    if (t > 1) e = std::min(22.5 * (t - 1), 36.66);
    if (t > 4) e = std::min(36.66 + 22.5 * (t - 4), 110.0);  // 7 V would be 128 V: clipped
    if (t > falls_from) e = std::max(110 - 20.4 * (t - falls_from), 0.0);
    ASSERT_NEAR(y.e_a[k], e, 1e-9) << t;
  }
}

TEST(Step, ADeadZoneTakesItsPartOffTheReference) {
  ModelStructure s = with({"driver_dead_zone"});
  s.driver.gain = 4;
  const Trajectory<double> y = run(s, and_(servo, {0.3}), holds(1e-3, {{0.1, 2}, {0.1, -2}, {0.1, 0.29}, {0.1, -0.1}}));
  EXPECT_NEAR(y.e_a[50], 4 * 1.7, 1e-12);
  EXPECT_NEAR(y.e_a[150], -4 * 1.7, 1e-12);
  EXPECT_EQ(y.e_a[250], 0);
  EXPECT_EQ(y.e_a[350], 0);
}

TEST(Step, ACurrentDriveAcceleratesTheShaftAlone) {
  const Excitation x = constant(1, 1e-3, 0.7, &Excitation::i_a);
  const Trajectory<double> y = run(with({}, Signal::i_a), servo, x);
  for (std::size_t k = 1; k < x.t.size(); ++k) {
    ASSERT_EQ(y.i_a[k], 0.7);
    ASSERT_NEAR(y.omega[k], K * 0.7 / B * (1 - std::exp(-B / J * x.t[k])), 1e-4);
  }
}

TEST(Step, AnOpenArmatureCarriesNoCurrentAndCoasts) {
  Excitation x = constant(2, 1e-3, 12, &Excitation::u_ref);
  x.armature_open.assign(x.t.size(), 1);
  x.initial.omega = 200;
  const Trajectory<double> y = run(with({"armature_inductance"}), and_(servo, {1e-3}), x);
  for (std::size_t k = 1; k < x.t.size(); ++k) {
    ASSERT_EQ(y.i_a[k], 0);
    ASSERT_NEAR(y.omega[k], 200 * std::exp(-B / J * x.t[k]), 1e-3);
  }
}

TEST(Step, AnArmatureThatClosesAgainStartsFromNoCurrent) {
  Excitation x = constant(0.2, 1e-3, 12, &Excitation::u_ref);
  for (const double t : x.t) x.armature_open.push_back(t < 0.1);
  const Trajectory<double> y = run(with({}), servo, x);
  EXPECT_EQ(y.omega[100], 0);
  const double tau = J * R / (R * B + K * K);
  EXPECT_NEAR(y.omega[150], K * 12 / (R * B + K * K) * (1 - std::exp(-0.05 / tau)), 0.02);
}

// ---- dry friction

TEST(Step, ACoastDownWithDryFrictionEndsInAStraightLineAndExactlyAtRest) {
  const double T_c = 0.003;
  Excitation x = constant(1, 1e-3, 0, &Excitation::i_a);
  x.initial.omega = 20;
  const Trajectory<double> y = run(with({"coulomb_friction"}, Signal::i_a), and_({R, K, K, 0, J}, {T_c}), x);
  const double stop = 20 * J / T_c;  // 0.4 s
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    ASSERT_NEAR(y.omega[k], std::max(0.0, 20 - T_c / J * x.t[k]), 1e-10) << x.t[k];
    if (x.t[k] > stop + 1e-3) {
      ASSERT_EQ(y.omega[k], 0);
      ASSERT_EQ(y.theta[k], y.theta.back());
    }
  }
  EXPECT_NEAR(y.theta.back(), 0.5 * 20 * stop, 0.5 * 20e-3);  // the moment of stopping is known to a step
}

TEST(Step, DryFrictionHoldsAShaftThatIsDrivenLessThanItsTorque) {
  const double T_c = 0.003;
  const ModelStructure s = with({"coulomb_friction", "load_torque"});
  const auto speed = [&](double volts, double load) {
    return run(s, and_(servo, {T_c, load}), constant(0.5, 1e-3, volts, &Excitation::u_ref)).omega;
  };
  const double breaks_away = T_c * R / K;
  EXPECT_THAT(speed(0.99 * breaks_away, 0), Each(0.0));
  EXPECT_THAT(speed(-0.99 * breaks_away, 0), Each(0.0));
  EXPECT_GT(speed(1.01 * breaks_away, 0).back(), 0);
  EXPECT_LT(speed(-1.01 * breaks_away, 0).back(), 0);
  EXPECT_THAT(speed(0, 0.99 * T_c), Each(0.0));
  EXPECT_THAT(speed(0, -0.99 * T_c), Each(0.0));
  EXPECT_LT(speed(0, 1.01 * T_c).back(), 0);  // a weight that wins pulls backwards
  EXPECT_GT(speed(1.5 * breaks_away, 0.4 * T_c).back(), 0);
  EXPECT_THAT(speed(1.5 * breaks_away, 0.6 * T_c), Each(0.0));
}

TEST(Step, DryFrictionTakesItsTorqueInBothDirections) {
  for (const double direction : {1.0, -1.0}) {
    const Trajectory<double> y =
        run(with({"coulomb_friction"}), and_(servo, {0.003}), constant(1, 1e-3, 12 * direction, &Excitation::u_ref));
    EXPECT_NEAR(y.omega.back(), direction * (K * 12 - R * 0.003) / (R * B + K * K), 1e-6);
    EXPECT_NEAR(y.i_a.back(), direction * (B * std::abs(y.omega.back()) + 0.003) / K, 1e-6);
  }
}

// ---- against a reference integration

TEST(Step, WindageAndInductanceFollowAReferenceIntegrationInSecondOrder) {
  const double L = 2e-3, c_w = 5e-8, T_L = 0.004;
  const auto voltage = [](double t) { return 12 * std::sin(2 * std::numbers::pi * 5 * t); };
  const auto f = [&](double t, const std::array<double, 3>& x) {
    const auto& [i, omega, theta] = x;
    return std::array{(voltage(t) - R * i - K * omega) / L,
                      (K * i - B * omega - c_w * omega * std::abs(omega) - T_L) / J, omega};
  };
  std::vector<std::array<double, 3>> exact{{0, 0, 0}};
  for (int n = 0; n < 60; ++n) exact.push_back(runge_kutta<3>(f, exact.back(), 5e-3 * n, 5e-3 * (n + 1), 1e-5));
  const auto error = [&](double h) {
    Excitation x;
    for (int k = 0; k * h < 0.3 + h / 2; ++k) {
      x.t.push_back(k * h);
      x.e_a.push_back(voltage(k * h));
    }
    x.longest_step = 1;
    ModelStructure s = with({"armature_inductance", "windage", "load_torque"}, Signal::e_a);
    s.measured_voltage = true;
    const Trajectory<double> y = run(s, and_(servo, {L, c_w, T_L}), x);
    const auto every = static_cast<std::size_t>(std::lround(5e-3 / h));
    double worst = 0;
    for (std::size_t n = 0; n <= 60; ++n) {
      worst =
          std::max({worst, std::abs(y.i_a[n * every] - exact[n][0]) / 5,
                    std::abs(y.omega[n * every] - exact[n][1]) / 200, std::abs(y.theta[n * every] - exact[n][2]) / 10});
      EXPECT_EQ(y.torque[n * every], T_L);
    }
    return worst;
  };
  EXPECT_LT(error(1e-3), 2e-3);
  EXPECT_NEAR(error(1e-3) / error(5e-4), 4, 0.6);
  EXPECT_NEAR(error(5e-4) / error(2.5e-4), 4, 0.6);
}

TEST(Step, VanishingInductanceIsNoInductance) {
  const Excitation x = holds(1e-3, {{0.1, 2}, {0.1, -3}, {0.1, 0.5}});
  const Trajectory<double> without = run(with({}), servo, x);
  for (const double L : {0.0, 1e-300, 1e-15, 1e-9}) {
    const Trajectory<double> y = run(with({"armature_inductance"}), and_(servo, {L}), x);
    const double tolerance = L < 1e-12 ? 1e-9 : 1e-4;  // L/(R h) is 1e-6 for the last: edges of 5 V in one sample
    EXPECT_LT(largest_error(y.omega, without.omega), tolerance) << L;
    EXPECT_LT(largest_error(y.i_a, without.i_a), tolerance) << L;
  }
}

TEST(Step, TheSensitivityToInductanceAtNoneIsThatOfASmallOne) {
  // 5 V/s^2: smooth, so that di/dt exists, and a reference integration with L = 0.5 mH shows what to expect.
  const auto voltage = [](double t) { return 5 * (1 - std::cos(20 * t)); };
  Excitation x;
  for (int k = 0; k <= 200; ++k) {
    x.t.push_back(1e-3 * k);
    x.e_a.push_back(voltage(1e-3 * k));
  }
  ModelStructure s = with({"armature_inductance"}, Signal::e_a);
  s.measured_voltage = true;
  std::vector<Sensitive> p(servo.begin(), servo.end());
  p.push_back(Sensitive::variable(0, 0));
  Trajectory<Sensitive> y;
  simulate<Sensitive>(s, p, x, y);
  const auto integrated = [&](double L) {
    return runge_kutta<2>(
        [&](double t, const std::array<double, 2>& z) {
          return std::array{(voltage(t) - R * z[0] - K * z[1]) / L, (K * z[0] - B * z[1]) / J};
        },
        {0, 0}, 0, 0.2, L / R / 20);
  };
  // Second-order one-sided in L: at L, 2 L and 3 L, extrapolated to none.
  const double L = 2e-5;
  const auto one = integrated(L), two = integrated(2 * L), three = integrated(3 * L);
  for (std::size_t i = 0; i < 2; ++i) {
    const double expected = (-2.5 * one[i] + 4 * two[i] - 1.5 * three[i]) / L;
    const double found = i == 0 ? y.i_a.back().d[0] : y.omega.back().d[0];
    EXPECT_NEAR(found, expected, 0.01 * std::abs(expected)) << i;
  }
  for (const Sensitive& i_a : y.i_a) ASSERT_TRUE(std::isfinite(i_a.d[0]));
}

// ---- what is measured upstream

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
  for (double& load : x.load) load = -0.003;
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

// ---- sensors

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
  EXPECT_EQ(without.theta, with_lag.theta);
  EXPECT_LT(with_lag.omega[120], without.omega[120]);
}

// ---- the driver's saturation and delay

TEST(Step, ASaturatedDriverGivesItsOwnLimitInPlaceOfTheKnownOne) {
  ModelStructure s = with({"driver_saturation"});
  s.driver = {.gain = 4, .min = -24, .max = 24};
  const Excitation x = holds(1e-3, {{0.01, 2}, {0.01, 6}, {0.01, -6}});
  const Trajectory<double> y = run(s, and_(servo, {21.5}), x);
  EXPECT_NEAR(y.e_a[8], 8, 1e-12);
  EXPECT_NEAR(y.e_a[18], 21.5, 1e-12);
  EXPECT_NEAR(y.e_a[28], -21.5, 1e-12);
}

TEST(Step, ADelayedDriverDoesTheSameLaterByAnyFractionOfASample) {
  ModelStructure s = with({"driver_delay"});
  s.driver = {.gain = 4, .rise = 2000, .fall = 2000};
  const Excitation x = holds(1e-3, {{0.02, 0}, {0.05, 3}, {0.05, -1}});
  const Trajectory<double> prompt = run(with({}), servo, holds(1e-3, {{0.02, 0}}));
  for (const double delay : {0.0, 0.003, 0.0104, 0.0477}) {
    const Trajectory<double> y = run(s, and_(servo, {delay}), x);
    for (std::size_t k = 0; k < x.t.size(); ++k) {
      const double t = x.t[k] - delay;
      const double rising = std::clamp((t - 0.02) * 2000, 0.0, 12.0);
      const double expected = std::max(rising - std::max(0.0, (t - 0.07) * 2000), rising > 0 && t > 0.07 ? -4.0 : 0.0);
      EXPECT_NEAR(y.e_a[k], expected, 1e-9) << delay << " s, t = " << x.t[k];
    }
  }
  EXPECT_EQ(prompt.e_a.back(), 0);
}

TEST(Step, AnIdealDriverIsThereAtOnceAndItsDelayMovesTheMotorByWhatItIs) {
  // Without slew limits a delay within a sample shows in the mean voltage alone.
  const double delay = 0.4e-3, h = 1e-3;
  const Excitation x = holds(h, {{0.01, 0}, {0.2, 12}});
  const Trajectory<double> late = run(with({"driver_delay"}), and_(servo, {delay}), x);
  const double gain = R * B + K * K, tau = J * R / gain;
  for (std::size_t k = 15; k < x.t.size(); k += 20) {
    const double expected = 12 * K / gain * (1 - std::exp(-(x.t[k] - 0.01 - delay) / tau));
    EXPECT_NEAR(late.omega[k], expected, 1e-2) << x.t[k];  // of 285 rad/s
  }
}

// ---- brushes and warm copper

TEST(Step, BrushesTakeTheirVoltageOnceACurrentFlowsAndAShareOfItBelowTheKnee) {
  const double V_b = 0.8, i_lin = 0.02;
  const auto settled = [&](double V, double load) {  // a weight makes the current
    return run(with({"brush_drop", "load_torque"}), and_(servo, {V_b, i_lin, load}),
               constant(3, 1e-3, V, &Excitation::u_ref));
  };
  for (const double sign : {1.0, -1.0}) {
    const auto loaded = settled(sign * 12, sign * 0.02);
    const double i = loaded.i_a.back();
    EXPECT_GT(std::abs(i), 0.4);
    EXPECT_NEAR(loaded.omega.back(), (sign * (12 - V_b) - R * i) / K, 1e-6);
    const auto light = settled(sign * 12, -sign * 0.0025);  // nearly carried by the weight
    const double small = light.i_a.back();
    EXPECT_LT(std::abs(small), i_lin);
    EXPECT_NEAR(light.omega.back(), (sign * 12 - R * small - V_b * std::tanh(small / i_lin)) / K,
                0.02);  // nearly settled
  }
}

TEST(Step, BrushesStopAnInductiveCurrentAtZeroWithoutChatter) {
  // A blocked rotor (huge J), the voltage taken away: R i + L di/dt = -V_b until i = 0, and then nothing.
  const double L = 0.05, V_b = 2;
  std::vector<double> blocked = servo;
  blocked[4] = 1e3;
  const Excitation x = holds(1e-3, {{0.5, 12}, {0.3, 0}});
  const Trajectory<double> y = run(with({"armature_inductance", "brush_drop"}), and_(blocked, {L, V_b, 1e-3}), x);
  const double i0 = (12 - V_b) / R;
  EXPECT_NEAR(y.i_a[499], i0, 1e-3);
  for (std::size_t k = 510; k < x.t.size(); ++k) {
    const double decaying = (i0 + V_b / R) * std::exp(-R / L * (x.t[k] - 0.5)) - V_b / R;
    ASSERT_NEAR(y.i_a[k], std::max(0.0, decaying), 0.02) << x.t[k];
    ASSERT_GE(y.i_a[k], -1e-6);
  }
  EXPECT_NEAR(y.i_a.back(), 0, 1e-6);  // the shaft still turns at 1e-5 rad/s
}

TEST(Step, ABlockedArmatureWarmsUpAsItsHeatCapacityAndResistanceSay) {
  // One body with constant power, but for the resistance itself: compared with a fine explicit integration.
  const double C_th = 4, R_th = 5, V = 6;
  std::vector<double> blocked = servo;
  blocked[4] = 1e6;
  const Excitation x = constant(60, 0.01, V, &Excitation::u_ref);
  const Trajectory<double> y = run(with({"armature_heating"}), and_(blocked, {C_th, R_th}), x);
  double warmer = 0;
  for (std::size_t k = 1; k < x.t.size(); ++k) {
    for (int part = 0; part < 10; ++part) {
      const double resistance = R * (1 + 0.00393 * warmer);
      warmer += 1e-3 * (V * V / resistance - warmer / R_th) / C_th;
    }
    if (k % 500 != 0) continue;
    EXPECT_NEAR(y.i_a[k], V / (R * (1 + 0.00393 * warmer)), 2e-3) << x.t[k];
  }
  EXPECT_GT(warmer, 60);
}

TEST(Step, WhereTheTemperatureIsMeasuredTheResistanceFollowsIt) {
  Excitation x = constant(1, 0.01, 6, &Excitation::u_ref);
  x.temperature.assign(x.t.size(), 70);
  std::vector<double> blocked = servo;
  blocked[4] = 1e6;
  const Trajectory<double> y = run(with({"armature_heating"}), and_(blocked, {4, 5}), x);
  EXPECT_NEAR(y.i_a.back(), 6 / (R * (1 + 0.00393 * 50)), 1e-3);
}

// ---- friction that falls with speed, and a reading that repeats with the angle

TEST(Step, StribeckFrictionHoldsMoreThanItTakesOnTheWay) {
  const double T_c = 0.02, T_s = 0.015, omega_s = 20;
  const auto friction = [&](double torque) {  // a current drive: torque over friction
    return run(with({"coulomb_friction", "stribeck_friction"}, Signal::i_a), and_(servo, {T_c, T_s, omega_s}),
               constant(1, 1e-3, torque / K, &Excitation::i_a));
  };
  EXPECT_THAT(friction(0.034).omega, Each(0));
  const auto sliding = friction(0.036);
  EXPECT_GT(sliding.omega.back(), 60);
  // Far beyond omega_s only T_c is left.
  const std::size_t n = sliding.omega.size();
  const double acceleration = (sliding.omega[n - 1] - sliding.omega[n - 2]) / 1e-3;
  EXPECT_NEAR(J * acceleration + B * sliding.omega[n - 1], 0.036 - T_c, 3e-6);
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
  for (std::size_t k = 500; k < x.t.size(); ++k) x.u_ref[k] = -1;
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
    if (k > 1000) x.u_ref[k] = 12;
  }
  const auto run_with = [&](const Excitation& e) { return run(with({"cogging"}), and_(servo, cogging), e); };
  const Trajectory<double> truth = run_with(x);
  for (std::size_t k = 0; k < x.t.size(); ++k) x.angle.push_back(truth.theta[k] + 0.2 * x.t[k]);  // [rad] it drifts
  EXPECT_GT(std::abs(run_with(x).omega[1000]), 0.1) << "where the measured angle counts, the well moves";
  x.angle_pull.assign(x.t.size(), 0);
  const Trajectory<double> free = run_with(x);
  for (std::size_t k = 0; k <= 1000; ++k) EXPECT_NEAR(free.omega[k], 0, 1e-12);
  for (std::size_t k = 1000; k < x.t.size(); ++k) x.angle_pull[k] = 100;
  const Trajectory<double> pulled = run_with(x);
  Excitation there = x;  // the rotor as far on as measured, from where it turns
  there.angle_pull.clear();
  const Trajectory<double> measured = run_with(there);
  EXPECT_NEAR(pulled.omega.back(), measured.omega.back(), 0.05);
}

// ---- against the same equations, written in a row

/// Readings of step.h and of PlainMachine, with derivatives with respect to four of the parameters.
void expect_the_plain_step(const testing_benches::TestBench& bench, const std::vector<double>& effects, bool voltage,
                           bool load, std::size_t first_derivative) {
  ModelStructure s =
      with({"driver_dead_zone", "armature_inductance", "coulomb_friction", "windage", "load_torque", "tacho_lag"});
  s.driver = bench.structure.driver;
  Excitation x = bench.excitation;
  x.longest_step = 1;
  if (voltage) {
    const std::vector<double> e = run(s, and_(bench.base, effects), x).e_a;
    for (std::size_t k = 0; k < e.size(); ++k)
      x.e_a.push_back(e[k] * 1.01 + 0.1 * std::sin(0.01 * static_cast<double>(k)));
  }
  if (load) {
    for (std::size_t k = 0; k < x.t.size(); ++k)
      x.load.push_back(effects[2] * std::sin(0.003 * static_cast<double>(k)));
  }
  s.measured_voltage = voltage;
  s.measured_load = load;
  const std::vector<double> values = and_(bench.base, effects);
  std::vector<Sensitive> p(values.begin(), values.end());
  for (std::size_t j = 0; j < 4; ++j) p[(first_derivative + j) % p.size()].d[j] = 1;
  Trajectory<Sensitive> y;
  simulate<Sensitive>(s, p, x, y);
  const PlainParameters<Sensitive> plain{p[0], p[1], p[2], p[3],  p[4], p[5], p[6],
                                         p[7], p[8], p[9], p[10], true, true, true};
  Trajectory<Sensitive> expected;
  run_plain(s.driver, plain, x, [&](std::size_t, const PlainMachine<Sensitive>& m) {
    expected.e_a.push_back(m.e_driver);
    expected.i_a.push_back(m.i_a);
    expected.omega.push_back(m.omega_reading);
    expected.theta.push_back(m.theta);
  });
  for (const auto signal : {&Trajectory<Sensitive>::e_a, &Trajectory<Sensitive>::i_a, &Trajectory<Sensitive>::omega,
                            &Trajectory<Sensitive>::theta}) {
    const auto same = [&](const auto& part, const std::string& what) {
      std::vector<double> a, b;
      for (const Sensitive& v : y.*signal) a.push_back(part(v));
      for (const Sensitive& v : expected.*signal) b.push_back(part(v));
      const double largest = std::abs(*std::ranges::max_element(b, {}, [](double v) { return std::abs(v); }));
      EXPECT_LE(largest_error(a, b), 3e-12 * largest) << what;
    };
    same([](const Sensitive& v) { return v.v; }, "value");
    for (std::size_t j = 0; j < 4; ++j) same([j](const Sensitive& v) { return v.d[j]; }, "derivative");
  }
}

TEST(Step, IsTheOneThatItsEquationsSay) {
  for (const bool voltage : {false, true}) {
    for (const bool load : {false, true}) {
      for (const std::size_t first : {0U, 4U, 8U}) {
        SCOPED_TRACE(testing::Message() << "voltage " << voltage << " load " << load << " derivatives from " << first);
        expect_the_plain_step(testing_benches::slow_bench(), {0.1, 1, 0.0547, 3e-6, 0.03, 0.03}, voltage, load, first);
        expect_the_plain_step(testing_benches::fast_bench(), {0.07, 2e-3, 0.003, 2e-8, 0.002, 0.007}, voltage, load,
                              first);
        expect_the_plain_step(testing_benches::fast_bench(), {0, 0, 0, 0, 0, 0}, voltage, load, first);
      }
    }
  }
}

// ---- time

TEST(Step, LongIntervalsAreDividedIntoTheSameSteps) {
  const std::vector<std::string_view> effects{"armature_inductance", "coulomb_friction", "windage", "tacho_lag"};
  const std::vector<double> values = and_(servo, {1e-3, 0.003, 2e-8, 0.01});
  Excitation fine = holds(1e-3, {{0.2, 0.5}, {0.2, -3}, {0.2, 0}});
  Excitation coarse = holds(1e-2, {{0.2, 0.5}, {0.2, -3}, {0.2, 0}});
  fine.longest_step = coarse.longest_step = 1e-3;
  const Trajectory<double> a = run(with(effects), values, fine), b = run(with(effects), values, coarse);
  for (std::size_t k = 0; k < coarse.t.size(); ++k) {
    EXPECT_NEAR(b.omega[k], a.omega[10 * k], 1e-9);
    EXPECT_NEAR(b.i_a[k], a.i_a[10 * k], 1e-9);
    EXPECT_NEAR(b.theta[k], a.theta[10 * k], 1e-9);
  }
}

TEST(Step, ReadingsMayComeAtAnyTime) {
  // A clock that jitters by 40 % and skips: the same machine.
  Excitation x;
  double t = 0;
  for (int k = 0; t < 0.4; ++k) {
    x.t.push_back(t);
    x.e_a.push_back(30 * t);
    t += 1e-3 * (1 + 0.4 * std::sin(3.7 * k)) + (k % 50 == 49 ? 7e-3 : 0);
  }
  ModelStructure s = with({"armature_inductance", "windage"}, Signal::e_a);
  s.measured_voltage = true;
  const double L = 2e-3, c_w = 5e-8;
  const Trajectory<double> y = run(s, and_(servo, {L, c_w}), x);
  const auto exact = runge_kutta<3>(
      [&](double at, const std::array<double, 3>& z) {
        return std::array{(30 * at - R * z[0] - K * z[1]) / L, (K * z[0] - B * z[1] - c_w * z[1] * std::abs(z[1])) / J,
                          z[1]};
      },
      {0, 0, 0}, 0, x.t.back(), 1e-5);
  EXPECT_NEAR(y.i_a.back(), exact[0], 1e-3 * exact[0]);
  EXPECT_NEAR(y.omega.back(), exact[1], 1e-4 * exact[1]);
  EXPECT_NEAR(y.theta.back(), exact[2], 1e-4 * exact[2]);
}

TEST(Step, AnEmptyRunIsNoTrouble) {
  const Trajectory<double> y = run(with({}), servo, Excitation{});
  EXPECT_TRUE(y.omega.empty());
}

TEST(Step, AnInitialSpeedThatIsReadHoldsTheOffsetOfItsReading) {
  Excitation x = constant(0.1, 1e-3, 0, &Excitation::u_ref);
  x.initial.omega = 1.5;  // [rad/s] of a shaft that stands
  x.initial.as_read = true;
  const Trajectory<double> y = run(with({"tacho_offset"}), and_(servo, {1.5}), x);
  EXPECT_THAT(y.omega, Each(1.5));
  x.initial.omega = 0;
  EXPECT_EQ(run(with({"tacho_offset"}), and_(servo, {1.5}), x).omega[0], 1.5) << "what was seen to stand stands";
}

TEST(Step, TheFirstReadingIsTheInitialState) {
  Excitation x = constant(0.01, 1e-3, 3, &Excitation::u_ref);
  x.initial = {.omega = 30, .theta = 2, .i_a = 0.4, .e_driver = 1.5};
  const Trajectory<double> y = run(with({"tacho_lag"}), and_(servo, {0.05}), x);
  EXPECT_EQ(y.omega[0], 30);  // the tacho's filter has settled there
  EXPECT_EQ(y.theta[0], 2);
  EXPECT_EQ(y.i_a[0], 0.4);
  EXPECT_EQ(y.e_a[0], 1.5);
  x.initial.e_driver.reset();
  EXPECT_EQ(run(with({}), servo, x).e_a[0], 3) << "settled at the first reference";
}

}  // namespace
}  // namespace emtb
