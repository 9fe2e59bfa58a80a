#include "analysis/estimate/inverse_dynamics.h"

#include <gmock/gmock.h>

#include <cmath>
#include <optional>

#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using testing::AllOf;
using testing::HasSubstr;

constexpr double J = 6e-5, B = 2e-5, T_c = 0.003, T_L = 0.001, K_m = 0.042;

double angle(double t) { return 100 * (1 - std::cos(2 * t)) + 20 * std::sin(0.7 * t); }
double swinging(double t) { return 200 * std::sin(2 * t) + 14 * std::cos(0.7 * t); }
double acceleration(double t) { return 400 * std::cos(2 * t) - 9.8 * std::sin(0.7 * t); }

/// The current that this motion needs.
double current(double t) {
  const double omega = swinging(t);
  return (J * acceleration(t) + B * omega + std::copysign(T_c, omega) + T_L) / K_m;
}

emtb::Run motion(std::optional<Signal> of, double noise_of_current = 0) {
  emtb::Run run;
  run.name = "motion.csv";
  synthetic::Noise noise(3);
  run.signals[Signal::i_a] = series(1e-3, 12, [&](double t) { return current(t) + noise(noise_of_current); });
  if (of) run.signals[*of] = series(1e-3, 12, *of == Signal::theta ? angle : swinging);
  return run;
}

std::string complaint(const emtb::Run& run) {
  try {
    inverse_dynamics(std::span(&run, 1), K_m);
  } catch (const SessionError& e) {
    return e.what();
  }
  return "accepted";
}

TEST(InverseDynamics, FindsTheParametersOfAMotionFromSpeedOrAngle) {
  for (const Signal of : {Signal::omega, Signal::theta}) {
    const emtb::Run run = motion(of);
    const InverseDynamics result = inverse_dynamics(std::span(&run, 1), K_m);
    ASSERT_EQ(result.values.size(), 4U);
    const double expected[] = {J, B, T_c, T_L};
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(result.values[i].value, expected[i], 0.005 * expected[i]) << result.values[i].symbol << info(of).name;
    }
    EXPECT_GT(result.r_squared, 0.99999);
    EXPECT_LT(result.residual, 5e-3 * T_c);
  }
}

TEST(InverseDynamics, StatesErrorsThatCover) {
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    emtb::Run run = motion(Signal::omega);
    synthetic::Noise noise(seed);
    for (double& i : run.signals[Signal::i_a].value.edit()) i += noise(0.05);
    const InverseDynamics result = inverse_dynamics(std::span(&run, 1), K_m);
    const double expected[] = {J, B, T_c, T_L};
    for (std::size_t i = 0; i < 4; ++i, ++all) {
      inside += std::abs(result.values[i].value - expected[i]) < 1.96 * result.values[i].std_error;
    }
  }
  EXPECT_GT(inside, 0.9 * all);
  EXPECT_LT(inside, 0.99 * all);
}

TEST(InverseDynamics, PoolsRuns) {
  const std::vector<emtb::Run> runs{motion(Signal::omega), motion(Signal::theta)};
  EXPECT_EQ(inverse_dynamics(runs, K_m).rows,
            inverse_dynamics(std::span(runs).first(1), K_m).rows + inverse_dynamics(std::span(runs).last(1), K_m).rows);
}

TEST(InverseDynamics, SaysWhatIsMissing) {
  emtb::Run run = motion(Signal::omega);
  run.signals.erase(Signal::i_a);
  EXPECT_THAT(complaint(run), AllOf(HasSubstr("motion.csv has no i_a_A"), HasSubstr("need the current")));
  EXPECT_THAT(complaint(motion({})), HasSubstr("motion.csv has neither theta_rad nor omega_rad_s"));
  run = motion(Signal::omega);
  run.signals[Signal::i_a] = series(0.4, 12, current);
  EXPECT_THAT(complaint(run), AllOf(HasSubstr("not read as often as the motion"), HasSubstr("emtb calibrate")));
  run = motion(Signal::omega);
  for (const Signal s : {Signal::i_a, Signal::omega}) {
    run.signals[s].t.resize(100);
    run.signals[s].value.resize(100);
  }
  EXPECT_THAT(complaint(run), HasSubstr("too short"));
  run = motion(Signal::omega);
  for (double& omega : run.signals[Signal::omega].value.edit()) omega = 0;
  EXPECT_THAT(complaint(run), HasSubstr("too few readings in motion"));
}

}  // namespace
}  // namespace emtb
