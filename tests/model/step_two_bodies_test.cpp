#include <gtest/gtest.h>

#include <cmath>
#include <functional>

#include "tests/model/step_bench.h"

namespace emtb {
namespace {

using namespace step_bench;

/// [N m/rad] and [N m s/rad] of the spring, [kg m2] behind and before it; [A]; [s]
constexpr double stiffness = 0.5, damping = 2e-4, J_2 = 3e-5, J_1 = J - J_2, current = 0.4, interval = 1e-4;

/// Two bodies and a spring by Newton, in steps of 1 us: a motor that a current drives, and a load.
struct TwoBodies {
  double gap = 0;
  std::function<double(double omega, double theta)> load;  ///< [N m]
  double theta = 0, omega = 0, theta_2 = 0, omega_2 = 0;

  double spring() const {
    const double twist = theta - theta_2, bent = twist - std::clamp(twist, -gap / 2, gap / 2);
    const double torque = stiffness * bent + damping * (omega - omega_2);
    return gap > 0 && torque * bent <= 0 ? 0 : torque;
  }

  void go_on(double seconds) {
    constexpr double dt = 1e-6;
    for (double t = 0; t < seconds - dt / 2; t += dt) {
      const double torque = spring();
      omega += dt * (K * current - B * omega - torque) / J_1;
      omega_2 += dt * (torque - load(omega_2, theta_2)) / J_2;
      theta += dt * omega;
      theta_2 += dt * omega_2;
    }
  }
};

/// What the model simulates lies so near to what Newton says, of the largest speed and of the largest torque.
void expect_near(TwoBodies truth, const Excitation& x, const Trajectory<double>& y, double near) {
  double speed = 0, torque = 1e-9, speed_off = 0, torque_off = 0;
  for (std::size_t n = 1; n < y.omega.size(); ++n) {
    truth.go_on(x.t[n] - x.t[n - 1]);
    const double takes = truth.load(truth.omega_2, truth.theta_2);
    speed = std::max(speed, std::abs(truth.omega));
    torque = std::max(torque, std::abs(takes));
    speed_off = std::max(speed_off, std::abs(y.omega[n] - truth.omega));
    torque_off = std::max(torque_off, std::abs(y.torque[n] - takes));
  }
  EXPECT_LT(speed_off, near * speed);
  EXPECT_LT(torque_off, near * torque);
}

TEST(TwoBodies, ALoadActsOnTheBodyBehindTheSpring) {
  const double T_e = 0.006, phase = 0.4, T_b = 0.004, omega_b = 60;
  const auto load = [&](double omega, double theta) {
    const double share = omega / omega_b;
    return T_e * std::sin(theta + phase) + 2 * T_b * share / (1 + share * share);
  };
  const Excitation x = constant(0.3, interval, current, &Excitation::i_a);
  const Trajectory<double> y = run(with({"shaft_compliance", "eccentric_load", "eddy_brake"}, Signal::i_a),
                                   and_({R, K, K, B, J}, {stiffness, damping, J_2, T_e, phase, T_b, omega_b}), x);
  expect_near({.load = load}, x, y, 5e-3);
}

TEST(TwoBodies, RowsOfAnyLengthFollowOneAnother) {
  Excitation x = constant(0.2, interval, current, &Excitation::i_a);
  for (std::size_t n = 1; n < x.t.size(); ++n) x.t.edit()[n] = x.t[n - 1] + (n % 3 == 0 ? 10 : 1) * interval;
  const Trajectory<double> y =
      run(with({"shaft_compliance"}, Signal::i_a), and_({R, K, K, B, J}, {stiffness, damping, J_2}), x);
  expect_near({.load = [](double, double) { return 0.0; }}, x, y, 5e-4);
}

TEST(TwoBodies, RingAsTheyShouldInStepsOfAnEighthOfAPeriod) {
  constexpr double pi = 3.14159265358979;
  const double period = 2 * pi / std::sqrt(stiffness * (1 / J_1 + 1 / J_2));
  const Excitation x = constant(0.2, period / 8, current, &Excitation::i_a);
  const Trajectory<double> y =
      run(with({"shaft_compliance"}, Signal::i_a), and_({R, K, K, B, J}, {stiffness, damping, J_2}), x);
  expect_near({.load = [](double, double) { return 0.0; }}, x, y, 1e-2);
}

TEST(TwoBodies, ABrakeOfTheLoadHoldsItWhileTheMotorBendsTheSpring) {
  const Trajectory<double> y =
      run(with({"shaft_compliance", "dry_brake"}, Signal::i_a), and_({R, K, K, B, J}, {stiffness, damping, J_2, 0.1}),
          constant(3, interval, current, &Excitation::i_a));
  EXPECT_NEAR(y.theta.back(), K * current / stiffness, 1e-3 * K * current / stiffness);
  EXPECT_NEAR(y.torque.back(), K * current, 1e-2 * K * current) << "the gauge reads what the brake holds";
}

TEST(TwoBodies, WithinAPlayTheMotorFeelsNothingOfTheLoad) {
  const double gap = 0.2, T_L = 0.002, falls_for = std::sqrt(gap * J_2 / T_L);
  const Trajectory<double> y =
      run(with({"backlash", "shaft_compliance", "load_torque"}, Signal::i_a),
          and_({R, K, K, B, J}, {gap, stiffness, damping, J_2, T_L}), constant(0.2, interval, 0, &Excitation::i_a));
  for (std::size_t n = 0; n < y.omega.size(); ++n) {
    const double t = static_cast<double>(n) * interval;
    if (t < falls_for - 2 * interval) {
      ASSERT_EQ(y.omega[n], 0) << t;
    } else if (t > falls_for + 5e-3) {
      ASSERT_LT(y.omega[n], 0) << t << ": the load has taken it along";
    }
  }
}

TEST(TwoBodies, ALoadThatFrictionHoldsAtRestHasBentTheSpring) {
  const double T_c = 0.005, gap = 0.1, T_L = 0.004;
  const Trajectory<double> y = run(
      with({"coulomb_friction", "backlash", "shaft_compliance", "load_torque"}, Signal::i_a),
      and_({R, K, K, B, J}, {T_c, gap, stiffness, damping, J_2, T_L}), constant(0.2, interval, 0, &Excitation::i_a));
  for (const double omega : y.omega) ASSERT_NEAR(omega, 0, 1e-12);
}

TEST(TwoBodies, AMeasuredTorqueLoadsTheBodyBehindTheSpring) {
  const double T_b = 0.004, omega_b = 60;
  ModelStructure s = with({"shaft_compliance", "eddy_brake"}, Signal::i_a);
  Excitation x = constant(0.3, interval, current, &Excitation::i_a);
  const Trajectory<double> truth = run(s, and_({R, K, K, B, J}, {stiffness, damping, J_2, T_b, omega_b}), x);
  x.load = truth.torque;
  x.omega = truth.omega;
  s.effects = {effect_index("shaft_compliance")};
  s.measured_load = true;
  const Trajectory<double> y = run(s, and_({R, K, K, B, J}, {stiffness, damping, J_2}), x);
  EXPECT_LT(largest_error(y.omega, truth.omega), 5e-3 * *std::ranges::max_element(truth.omega));
}

}  // namespace
}  // namespace emtb
