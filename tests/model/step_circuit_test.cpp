#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "tests/model/reference.h"
#include "tests/model/step_bench.h"

namespace emtb {
namespace {

// The driver's saturation and delay, brushes, warm copper.

using namespace step_bench;

TEST(Step, ASaturatedDriverGivesItsOwnLimitInPlaceOfTheKnownOne) {
  ModelStructure s = with({"driver_saturation"});
  s.driver = {.gain = 4, .min = -24, .max = 24};
  const Excitation x = holds(1e-3, {{0.01, 2}, {0.01, 6}, {0.01, -6}});
  const Trajectory<double> y = run(s, and_(servo, {21.5}), x);
  EXPECT_NEAR(y.e_a[8], 8, 1e-12);
  EXPECT_NEAR(y.e_a[18], 21.5, 1e-12);
  EXPECT_NEAR(y.e_a[28], -21.5, 1e-12);
}

TEST(Step, ALimitedSourceHoldsItsCurrentByGivingLessVoltage) {
  constexpr double limit = 3;  // [A]
  ModelStructure s = with({"current_limit"});
  s.driver = {.gain = 4, .min = -24, .max = 24};
  const Excitation x = holds(1e-4, {{0.005, 0}, {0.15, 4}, {0.7, -4}});
  ModelStructure unlimited = with({});
  unlimited.driver = s.driver;
  const Trajectory<double> y = run(s, and_(servo, {limit}), x), free = run(unlimited, servo, x);
  const auto [R_a, K_b, K_m, B, J] = std::tie(servo[0], servo[1], servo[2], servo[3], servo[4]);
  double held = 0;
  for (std::size_t k = 1; k < x.t.size(); ++k) {
    ASSERT_LE(std::abs(y.i_a[k]), limit * 1.001) << x.t[k];
    EXPECT_NEAR(y.e_a[k], R_a * y.i_a[k] + K_b * y.omega[k], 0.02) << x.t[k];
    if (std::abs(y.i_a[k]) < 0.999 * limit || std::abs(y.i_a[k - 1]) < 0.999 * limit) continue;
    held += x.t[k] - x.t[k - 1];
    const double torque = K_m * std::copysign(limit, y.i_a[k]) - B * y.omega[k];
    EXPECT_NEAR((y.omega[k] - y.omega[k - 1]) / (x.t[k] - x.t[k - 1]), torque / J, 0.01 * std::abs(torque) / J);
  }
  EXPECT_GT(held, 0.1) << "the limit is reached";
  EXPECT_NEAR(y.omega.back(), free.omega.back(), 0.01 * std::abs(free.omega.back())) << "and the top speed";
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

/// A large machine of little resistance: at full speed the back-EMF moves the current far more than R_a does.
const std::vector<double> large_machine{0.1, 1.6, 1.6, 0.02, 7};

TEST(Step, AFluxThatTheCurrentWeakensSettlesWhereBothAgree) {
  // Held at speed by its inertia while the voltage goes to and fro about the back-EMF, driving and braking. Explicit in
  // the current, each step would swing further: k_i E/(i_k R_a) is 5.
  const double k_i = 0.1, i_k = 300;
  std::vector<double> held = and_(large_machine, {k_i, i_k});
  held[4] = 1e9;
  Excitation x = holds(5e-3, {{0.5, 170}, {0.5, 130}, {0.5, 150}});
  x.initial.omega = 100;
  x.initial.as_read = true;
  const Trajectory<double> y = run(with({"armature_reaction"}), held, x);
  for (const std::size_t k : {std::size_t{90}, std::size_t{190}, std::size_t{290}}) {
    const double share = y.i_a[k] / i_k, flux = 1 - k_i * share * share / (1 + share * share);
    EXPECT_NEAR(0.1 * y.i_a[k] + 1.6 * flux * y.omega[k], x.u_ref[k], 1e-6) << y.i_a[k];
    EXPECT_NEAR(y.i_a[k], y.i_a[k - 1], 1e-3);
  }
}

TEST(Step, AFluxThatTheCurrentWeakensMovesTheMotorAsItsEquationSays) {
  const double k_i = 0.12, i_k = 300;
  const Excitation x = holds(5e-3, {{1, 20}, {1, 60}, {1, 10}, {1, -30}});
  const Trajectory<double> y = run(with({"armature_reaction"}), and_(large_machine, {k_i, i_k}), x);
  const auto flux = [&](double i) { return 1 - k_i * i * i / (i_k * i_k + i * i); };
  const auto current = [&](double e, double omega) {  // bisection: with these values there is one
    double low = -1e5, high = 1e5;
    for (int n = 0; n < 60; ++n) {
      const double i = 0.5 * (low + high);
      (0.1 * i + 1.6 * flux(i) * omega > e ? high : low) = i;
    }
    return low;
  };
  std::array<double, 1> omega{0};
  double most = 0, fastest = 0;
  for (std::size_t k = 0; k + 1 < x.t.size(); ++k) {
    const double e = x.u_ref[k];
    omega = runge_kutta(
        [&](double, const std::array<double, 1>& w) {
          const double i = current(e, w[0]);
          return std::array<double, 1>{(1.6 * flux(i) * i - 0.02 * w[0]) / 7};
        },
        omega, x.t[k], x.t[k + 1], 1e-3);
    most = std::max(most, std::abs(omega[0] - y.omega[k + 1]));
    fastest = std::max(fastest, std::abs(omega[0]));
  }
  EXPECT_GT(fastest, 30);
  EXPECT_LT(most, 2e-3 * fastest);
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

TEST(Step, ACurrentThatFlowsBackLosesTheRiseOfALightLoadAndTurnsWhereItCannotFlowOn) {
  // A flywheel keeps the speed; the voltage goes down below the back-EMF by more than the rise, and up again.
  const double V_d = 2, i_c = 0.5, omega = 200;
  std::vector<double> flywheel = and_(servo, {V_d, i_c});
  flywheel[4] = 1e3;
  ModelStructure s = with({"discontinuous_conduction"});
  s.driver = {.gain = 1, .min = -24, .max = 24};
  Excitation x;
  for (int k = 0; k <= 400; ++k) {
    x.t.push_back(1e-3 * k);
    x.u_ref.push_back(K * omega + (k < 200 ? 1 - 0.03 * k : -5 + 0.03 * (k - 200)));
  }
  x.initial.omega = omega;
  const Trajectory<double> y = run(s, flywheel, x);
  std::size_t turned_back = 0, turned_again = 0;
  for (std::size_t k = 2; k + 1 < x.t.size(); ++k) {
    const double left = x.u_ref[k - 1] - K * omega, i = y.i_a[k];
    ASSERT_NEAR(R * i, left + V_d * std::exp(-std::abs(i) / i_c), 1e-4) << x.t[k] << " s";
    if (i < 0 && turned_back == 0) turned_back = k;
    if (turned_back > 0 && i >= 0 && turned_again == 0) turned_again = k;
  }
  const double knee = R * i_c;
  EXPECT_NEAR(x.u_ref[turned_back - 1] - K * omega, -V_d, 0.04);
  EXPECT_NEAR(x.u_ref[turned_again - 1] - K * omega, knee * (std::log(knee / V_d) - 1), 0.04);
}

}  // namespace
}  // namespace emtb
