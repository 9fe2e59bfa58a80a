#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "tests/model/step_bench.h"

namespace emtb {
namespace {

// Dry friction holds, brakes and lets go.

using testing::Each;
using namespace step_bench;

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

// Straight lines of the speed, which friction bends where it is zero: at any step, and wherever that lies in it.
TEST(Step, DryFrictionTurnsRoundWithTheShaftWithinAStep) {
  const double T_c = 0.003, current = -0.2, began = 11;
  const double slows = (K * current - T_c) / J, goes_back = (K * current + T_c) / J;  // [rad/s2]
  const double turns = -began / slows;
  for (const double step : {1e-3, 0.7e-3, 5e-3}) {
    Excitation x = constant(0.2, step, current, &Excitation::i_a);
    x.initial.omega = began;
    const Trajectory<double> y = run(with({"coulomb_friction"}, Signal::i_a), and_({R, K, K, 0, J}, {T_c}), x);
    for (std::size_t n = 0; n < x.t.size(); ++n) {
      const double t = x.t[n];
      ASSERT_NEAR(y.omega[n], t < turns ? began + slows * t : goes_back * (t - turns), 1e-9) << step << ' ' << t;
    }
  }
}

TEST(Step, DryFrictionTakesItsTorqueInBothDirections) {
  for (const double direction : {1.0, -1.0}) {
    const Trajectory<double> y =
        run(with({"coulomb_friction"}), and_(servo, {0.003}), constant(1, 1e-3, 12 * direction, &Excitation::u_ref));
    EXPECT_NEAR(y.omega.back(), direction * (K * 12 - R * 0.003) / (R * B + K * K), 1e-6);
    EXPECT_NEAR(y.i_a.back(), direction * (B * std::abs(y.omega.back()) + 0.003) / K, 1e-6);
  }
}

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

TEST(Step, GearsRubInProportionToTheTorqueThatTheyCarry) {
  const double T_c = 0.003, k_l = 0.2;
  const ModelStructure s = with({"coulomb_friction", "load_dependent_friction", "load_torque"});
  for (const double load : {-0.06, 0.0, 0.04}) {
    const Trajectory<double> y = run(s, and_(servo, {T_c, k_l, load}), constant(1, 1e-3, 12, &Excitation::u_ref));
    const double motor = K * y.i_a.back();
    EXPECT_GT(y.omega.back(), 100);
    EXPECT_NEAR(motor, load + B * y.omega.back() + T_c + k_l * std::abs(motor + load), 1e-7) << load;
  }
}

TEST(Step, GearsHoldALoadThatAloneWouldTurnThem) {
  const auto speed = [&](double k_l, double load) {  // no current: the load alone is on the gears
    return run(with({"coulomb_friction", "load_dependent_friction", "load_torque"}, Signal::i_a),
               and_(servo, {0.003, k_l, load}), constant(0.5, 1e-3, 0, &Excitation::i_a))
        .omega.back();
  };
  EXPECT_LT(speed(0, 0.0033), 0);
  EXPECT_EQ(speed(0.1, 0.0033), 0) << "up to T_c/(1 - k_l)";
  EXPECT_LT(speed(0.1, 0.0034), 0);
}

TEST(Step, DryFrictionThatGivesSpringsBackAndSlipsAtItsTorque) {
  const double T_c = 0.003, sigma_0 = 0.3;
  const ModelStructure s = with({"coulomb_friction", "presliding_friction"}, Signal::i_a);
  const auto angle = [&](double torque) {
    Excitation x = constant(1, 1e-3, torque / K, &Excitation::i_a);
    return run(s, and_({R, K, K, 0, J}, {T_c, sigma_0}), x).theta.back();
  };
  EXPECT_NEAR(angle(0.002), 0.002 / sigma_0, 1e-6);
  EXPECT_NEAR(angle(-0.002), -0.002 / sigma_0, 1e-6);
  EXPECT_GT(angle(0.0031), 0.5) << "it slips";
  Excitation x = constant(1, 1e-3, 0.002 / K, &Excitation::i_a);
  for (std::size_t k = 500; k < x.t.size(); ++k) x.i_a.edit()[k] = 0;
  EXPECT_NEAR(run(s, and_({R, K, K, 0, J}, {T_c, sigma_0}), x).theta.back(), 0, 1e-6) << "and springs back";
}

TEST(Step, AStiffBristleIsDryFriction) {
  const Excitation x = holds(1e-3, {{0.2, 0}, {0.5, 3}, {0.5, -2}, {0.5, 0}});
  const Trajectory<double> dry = run(with({"coulomb_friction"}), and_(servo, {0.003}), x);
  const Trajectory<double> bristles =
      run(with({"coulomb_friction", "presliding_friction"}), and_(servo, {0.003, 1e4}), x);
  EXPECT_LT(largest_error(dry.omega, bristles.omega), 0.02);
}

TEST(Step, BearingDragGrowsWithTheSpeedToTheTwoThirds) {
  for (const double volts : {-12.0, 2.0, 12.0}) {
    const Trajectory<double> y =
        run(with({"bearing_drag"}), and_(servo, {4e-5}), constant(2, 1e-3, volts, &Excitation::u_ref));
    const double w = y.omega.back();
    EXPECT_NEAR(K * y.i_a.back(), B * w + std::copysign(4e-5 * std::cbrt(w * w), w), 1e-9) << volts;
  }
}

TEST(Step, ACoastDownWithBearingDragIsThatOfItsEquation) {
  const double c_b = 4e-5;
  Excitation x = constant(0.5, 1e-3, 0, &Excitation::i_a);
  x.initial.omega = 30;
  const Trajectory<double> y = run(with({"bearing_drag"}, Signal::i_a), and_({R, K, K, 0, J}, {c_b}), x);
  for (std::size_t k = 0; k < x.t.size(); ++k) {  // the cube root of the speed falls in a straight line
    ASSERT_NEAR(y.omega[k], std::pow(std::cbrt(30) - c_b / J / 3 * x.t[k], 3), 1e-4) << x.t[k];
  }
}

TEST(Step, ADryBrakeTakesItsTorqueAndTheGaugeReadsIt) {
  const double T_c = 0.003, T_b = 0.006;
  for (const double volts : {-12.0, 12.0}) {
    const Trajectory<double> y = run(with({"coulomb_friction", "dry_brake"}), and_(servo, {T_c, T_b}),
                                     constant(1, 1e-3, volts, &Excitation::u_ref));
    const double direction = volts > 0 ? 1 : -1;
    EXPECT_EQ(y.torque.back(), direction * T_b);
    EXPECT_NEAR(K * y.i_a.back(), B * y.omega.back() + direction * (T_b + T_c), 1e-8);
  }
}

TEST(Step, ADryBrakeAtRestTakesWhatTheMotorsOwnFrictionLeaves) {
  const double T_c = 0.003, T_b = 0.006;
  const auto at = [&](double torque) {  // a current drive
    return run(with({"coulomb_friction", "dry_brake"}, Signal::i_a), and_(servo, {T_c, T_b}),
               constant(0.2, 1e-3, torque / K, &Excitation::i_a));
  };
  for (const double torque : {-0.0089, -0.005, -0.002, 0.0, 0.002, 0.005, 0.0089}) {
    const Trajectory<double> y = at(torque);
    EXPECT_THAT(y.omega, Each(0.0)) << torque;
    EXPECT_NEAR(y.torque.back(), std::copysign(std::max(std::abs(torque) - T_c, 0.0), torque), 1e-12) << torque;
  }
  EXPECT_GT(at(0.0091).omega.back(), 0);
}

TEST(Step, ADetentBesideWhatStaysTheSameIsSteppedAsBesideWhatDoesNot) {
  const auto motion = [](std::vector<std::string_view> effects, std::vector<double> values) {
    return run(with(effects), and_(servo, values), constant(1, 1e-3, 1.5, &Excitation::u_ref));
  };
  const double T_c = 0.003, T_cog = 0.002, none = 0;
  const Trajectory<double> beside_friction = motion({"coulomb_friction", "cogging"}, {T_c, T_cog, 12, 0.4});
  const Trajectory<double> beside_windage =
      motion({"coulomb_friction", "windage", "cogging"}, {T_c, none, T_cog, 12, 0.4});
  ASSERT_GT(beside_friction.omega.back(), 1);
  for (std::size_t k = 0; k < beside_friction.omega.size(); ++k) {
    ASSERT_NEAR(beside_friction.omega[k], beside_windage.omega[k], 1e-9) << k;
    ASSERT_NEAR(beside_friction.i_a[k], beside_windage.i_a[k], 1e-9) << k;
  }
}

}  // namespace
}  // namespace emtb
