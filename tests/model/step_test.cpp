#include "model/step.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

#include "tests/model/plain_machine.h"
#include "tests/model/reference.h"
#include "tests/model/step_bench.h"

namespace emtb {
namespace {

using testing::Each;
using namespace step_bench;

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

/// An air drag of zero changes nothing, but that the step is then made as it is in general.
/// @param skips the clock, once
void expect_linear_as_in_general(std::vector<std::string_view> effects, std::vector<double> values, bool voltage,
                                 bool opens, bool skips) {
  Excitation x = holds(1e-3, {{0.2, 0.5}, {0.2, -3}, {0.2, 0}});
  const std::vector<double> e = run(with({}), servo, x).e_a;
  for (std::size_t k = 0; k < e.size(); ++k) {
    if (voltage) x.e_a.push_back(e[k] * 1.01 + 0.1 * std::sin(0.01 * static_cast<double>(k)));
    if (opens) x.armature_open.push_back(k > 300 && k < 340 ? 1 : 0);
    if (skips && k > 250) x.t.edit()[k] += 0.4e-3;
  }
  const auto simulated = [&] {
    ModelStructure s = with(effects);
    s.measured_voltage = voltage;
    return run(s, and_(servo, values), x);
  };
  const Trajectory<double> linear = simulated();
  effects.insert(effects.begin() + static_cast<std::ptrdiff_t>(effects.size() / 2), "windage");  // of the shaft
  values.insert(values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), 0.0);
  const Trajectory<double> general = simulated();
  EXPECT_LT(largest_error(linear.omega, general.omega), 1e-10);
  EXPECT_LT(largest_error(linear.i_a, general.i_a), 1e-11);
  EXPECT_LT(largest_error(linear.theta, general.theta), 1e-10);
  EXPECT_LT(largest_error(linear.e_a, general.e_a), 1e-12);
  EXPECT_LT(largest_error(linear.torque, general.torque), 1e-12);
}

TEST(Step, ALinearOneIsTheGeneralOneMultipliedOut) {
  for (const bool voltage : {false, true}) {
    for (const bool opens : {false, true}) {
      for (const bool skips : {false, true}) {
        SCOPED_TRACE(testing::Message() << "voltage " << voltage << " opens " << opens << " skips " << skips);
        const auto expect_it = [&](std::vector<std::string_view> effects, std::vector<double> values) {
          expect_linear_as_in_general(std::move(effects), std::move(values), voltage, opens, skips);
        };
        expect_it({}, {});
        expect_it({"coulomb_friction", "load_torque"}, {0.003, 0.004});
        expect_it({"armature_inductance", "load_torque"}, {2e-3, -0.002});
        expect_it({"driver_output_resistance", "driver_lag", "armature_inductance", "load_torque"},
                  {0.3, 0.01, 1e-3, 0.002});
      }
    }
  }
}

TEST(Step, AMachineThatFollowsOtherParametersGoesOnWithThem) {
  const ModelStructure s = with({"driver_gain_error", "coulomb_friction", "load_torque"});
  const std::vector<double> before = and_(servo, {0.1, 0.2, 0.003, 0.001}),
                            after = and_({2 * R, K, K, B, J}, {-0.1, 0.3, 0.006, 0.002});
  Machine<double> followed(s, before), made(s, after);
  StepInput in;
  in.u_ref = 5;
  followed.start({}, in);
  followed.step(in, 0, 1e-3);
  followed.follow(after);
  made.start({}, in);
  for (int k = 1; k < 3000; ++k) {
    followed.step(in, 1e-3 * k, 1e-3);
    made.step(in, 1e-3 * k, 1e-3);
  }
  EXPECT_NEAR(followed.omega, made.omega, 1e-9);
  EXPECT_NEAR(followed.i_a, made.i_a, 1e-11);
  EXPECT_NEAR(followed.e_a_reading, made.e_a_reading, 1e-12);
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

TEST(Step, ALongRowInWhichAllComesToStandIsGoneThroughAtOnce) {
  const std::vector<std::string_view> effects{"armature_inductance", "coulomb_friction", "windage"};
  const std::vector<double> values = and_(servo, {1e-3, 0.003, 2e-8});
  Excitation fine = holds(1e-3, {{4, 0.5}, {4, -3}, {4, 0}});
  Excitation coarse = holds(2, {{4, 0.5}, {4, -3}, {4, 0}});
  fine.longest_step = coarse.longest_step = fine.quick_step = coarse.quick_step = 1e-3;
  ASSERT_TRUE(keeps_no_past(with(effects), coarse));
  EXPECT_FALSE(keeps_no_past(with({"tacho_lag"}), coarse));
  EXPECT_FALSE(keeps_no_past(with({"friction_warmup"}), coarse));
  EXPECT_FALSE(keeps_no_past(with({"cogging"}), coarse));
  EXPECT_LT(steps_of(with(effects), coarse), steps_of(with(effects), fine) / 4);
  const Trajectory<double> a = run(with(effects), values, fine), b = run(with(effects), values, coarse);
  for (std::size_t k = 0; k < coarse.t.size(); ++k) {
    EXPECT_NEAR(b.omega[k], a.omega[2000 * k], 1e-7) << k;
    EXPECT_NEAR(b.i_a[k], a.i_a[2000 * k], 1e-9) << k;
    EXPECT_NEAR(b.theta[k], a.theta[2000 * k], 1e-7) << k;
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
