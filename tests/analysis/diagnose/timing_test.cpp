// What the logger's timing does is no effect: a reference that acts before or after its row is read, a channel that is
// read behind the others.
#include "analysis/fit/timing.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <span>

#include "analysis/diagnose/diagnose.h"
#include "session/spec.h"
#include "tests/analysis/diagnose/answers.h"
#include "tests/analysis/synthetic.h"
#include "tests/blind/recording.h"

namespace emtb::timing_tests {
namespace {

using testing::IsEmpty;

/// What a channel shows that is read behind the others by a part of a sample.
Series behind(Series series, double share) {
  for (std::size_t k = series.value.size(); k-- > 1;) {
    series.value.edit()[k] += share * (series.value[k - 1] - series.value[k]);
  }
  return series;
}

/// The fast bench.
class LoggedTiming : public testing::Test {
 protected:
  blind::Bench bench = blind::fast_bench();

  std::vector<emtb::Run> runs(bool held_out, double current_behind, bool read_after_the_write) const {
    std::vector<emtb::Run> all = record(bench, held_out ? bench.held_out : bench.train, held_out ? 101 : 1);
    for (emtb::Run& run : all) {
      for (auto& [signal, series] : run.signals) {
        if (signal == Signal::i_a) series = behind(std::move(series), current_behind);
        if (signal != Signal::u_ref && read_after_the_write && !series.value.empty()) {
          series.value.erase(series.value.begin());  // each row shows what came after it
          series.value.push_back(series.value.back());
        }
      }
    }
    return all;
  }
};

TEST_F(LoggedTiming, OfAChannelBehindTheOthersIsFoundAndIsNoEffect) {
  for (const double share : {0.3, 0.8}) {
    const Diagnosis d = diagnose(runs(false, share, false), runs(true, share, false), bench.model);
    EXPECT_THAT(d.missing, IsEmpty());
    EXPECT_EQ(d.verdict, Verdict::nothing_missing);
    ASSERT_TRUE(d.data->timing.late.contains(Signal::i_a));
    EXPECT_NEAR(d.data->timing.late.at(Signal::i_a), share, 0.1);
    EXPECT_LE(d.final_held_out, 1.1);
  }
}

TEST_F(LoggedTiming, OfRowsReadInTimeIsLeftAsItIs) {
  const Diagnosis d = diagnose(runs(false, 0, false), runs(true, 0, false), bench.model);
  EXPECT_THAT(d.data->timing.late, IsEmpty());
  EXPECT_EQ(d.verdict, Verdict::nothing_missing);
}

TEST_F(LoggedTiming, OfRowsReadAfterTheyWereWrittenIsNoEffect) {
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::e_a; });  // it would tell the motor when
  const Diagnosis d = diagnose(runs(false, 0, true), runs(true, 0, true), bench.model);
  EXPECT_THAT(d.missing, IsEmpty());
  EXPECT_LT(d.data->timing.acts_after, 0);
  EXPECT_LE(d.final_held_out, 1.1);
}

/// A motor behind a driver that follows at once, logged every 20 ms; its tachogenerator lags by less than a row.
/// Between two rows all is exponential.
emtb::Run behind_a_lag(double tau, unsigned seed) {
  constexpr std::size_t rows = 400, hold = 9;
  constexpr double row = 0.02, R_a = 1.2, K = 0.042, B = 1.2e-5, J = 2e-4;
  const double damping = B + K * K / R_a, tau_m = J / damping;
  synthetic::Noise noise(seed);
  emtb::Run run;
  run.name = "lag";
  double omega = 0, read = 0, e_a = 0;
  for (std::size_t k = 0; k < rows; ++k) {
    const double u_ref = 8 * std::sin(2.4 * static_cast<double>(seed + k / hold));
    const std::map<Signal, double> row_of{{Signal::u_ref, u_ref},
                                          {Signal::omega, read + noise(0.1)},
                                          {Signal::i_a, (e_a - K * omega) / R_a + noise(0.01)}};
    for (const auto& [signal, value] : row_of) {
      run.signals[signal].t.push_back(row * static_cast<double>(k));
      run.signals[signal].value.push_back(value);
    }
    e_a = u_ref;  // once the row is read
    const double settled = K / R_a * e_a / damping, decays = (omega - settled) * tau_m / (tau_m - tau);
    read = settled + decays * std::exp(-row / tau_m) + (read - settled - decays) * std::exp(-row / tau);
    omega = settled + (omega - settled) * std::exp(-row / tau_m);
  }
  return run;
}

TEST(TimingOfALog, DoesNotStandInForALagOfLessThanARowWhoseShapeItDoesNotHave) {
  constexpr double tau = 0.016;  // [s] of a row of 0.02
  Model model = synthetic::servo_model();
  model.driver = DriverModel{.gain = 1, .min = -24, .max = 24};
  const Diagnosis d =
      diagnose(std::vector{behind_a_lag(tau, 1), behind_a_lag(tau, 2)}, std::vector{behind_a_lag(tau, 3)}, model);
  EXPECT_THAT(answers::named(d), testing::ElementsAre("tacho_lag")) << answers::report(d);
  EXPECT_NEAR(answers::fitted(d, "tau"), tau, 0.05 * tau);
}

/// What a driver makes of a reference that it is given some rows ago, through one pole or two.
struct Poles {
  std::size_t delay = 0;         ///< [rows]
  double first = 0, second = 0;  ///< [s] 0: none
  double load = 0;               ///< [N m] that pulls the shaft
};

/// A motor behind such a driver, logged every 1 ms with the voltage at its terminals.
emtb::Run behind(const Poles& driver, unsigned seed) {
  constexpr std::size_t rows = 1500, hold = 120, steps = 10;  // steps of a row
  constexpr double row = 1e-3, h = row / steps, R_a = 1.2, K = 0.042, B = 1.2e-5, J = 2e-4;
  synthetic::Noise noise(seed);
  const auto reference = [&](std::size_t k) { return 8 * std::sin(2.4 * static_cast<double>(seed + k / hold)); };
  emtb::Run run;
  run.name = "poles";
  double omega = 0, between = 0, e_a = 0;
  for (std::size_t k = 0; k < rows; ++k) {
    const std::map<Signal, double> row_of{{Signal::u_ref, reference(k)},
                                          {Signal::e_a, e_a + noise(0.01)},
                                          {Signal::omega, omega + noise(0.1)},
                                          {Signal::i_a, (e_a - K * omega) / R_a + noise(0.01)}};
    for (const auto& [signal, value] : row_of) {
      run.signals[signal].t.push_back(row * static_cast<double>(k));
      run.signals[signal].value.push_back(value);
    }
    const double u_ref = k >= driver.delay ? reference(k - driver.delay) : 0;
    for (std::size_t s = 0; s < steps; ++s) {
      const auto follow = [&](double& y, double to, double tau) {
        y = tau > 0 ? to + (y - to) * std::exp(-h / tau) : to;
      };
      follow(between, u_ref, driver.first);
      const double before = e_a;
      follow(e_a, between, driver.second);
      const double current = (0.5 * (before + e_a) - K * omega) / R_a;
      omega += h / J * (K * current - B * omega - driver.load);
    }
  }
  return run;
}

Diagnosis of_a_driver(
    const Poles& driver, emtb::Run (*as_recorded)(emtb::Run) = [](emtb::Run run) { return run; }) {
  Model model = synthetic::servo_model();
  model.driver = DriverModel{.gain = 1, .min = -24, .max = 24};
  const auto run = [&](unsigned seed) { return as_recorded(behind(driver, seed)); };
  return diagnose(std::vector{run(1), run(2)}, std::vector{run(3)}, model);
}

TEST(TimingOfADriver, NamesADelayBesideALagWhereBothLeaveNothing) {
  const Diagnosis d = of_a_driver({.delay = 2, .first = 0.01});
  EXPECT_THAT(answers::named(d), testing::UnorderedElementsAre("driver_lag", "driver_delay")) << answers::report(d);
  EXPECT_NEAR(answers::fitted(d, "t_d"), 2e-3, 2e-4);
}

TEST(TimingOfADriver, HoldsALagAgainstAnInductanceAtItsOwnStart) {
  // The runs begin amid an edge, and nobody reads the terminals: how far the driver has come by then is another where
  // the coil makes the current late.
  const Diagnosis d = of_a_driver({.first = 0.01}, [](emtb::Run run) {
    run = cut(run, 0.125, 1.5);
    run.signals.erase(Signal::e_a);
    return run;
  });
  EXPECT_THAT(answers::named_or_tied(d), testing::UnorderedElementsAre("driver_lag", "armature_inductance"))
      << answers::report(d);
  // Each has a resistance of its own, and both lie within the interval that is told.
  ASSERT_EQ(d.missing.size(), 1U);
  const Parameter& R_a = d.final.at(base::R_a);
  const auto other = std::ranges::find(d.missing[0].otherwise, "R_a", &OtherValue::name);
  ASSERT_NE(other, d.missing[0].otherwise.end());
  EXPECT_GT(std::abs(other->value - R_a.value), 0.05);
  EXPECT_NEAR(R_a.value, other->value, 1.96 * R_a.std_error.value());
  EXPECT_NEAR(R_a.value, 1.2, 1.96 * R_a.std_error.value());
}

TEST(TimingOfADriver, NamesALagOfLessThanARowThatALateInstrumentHasTheDelayOf) {
  const Diagnosis d = of_a_driver({.first = 0.0007, .load = 0.03}, [](emtb::Run run) {
    run.signals.erase(Signal::i_a);
    const std::span<double> omega = run.signals.at(Signal::omega).value.edit();  // half a row late
    for (std::size_t k = omega.size() - 1; k > 0; --k) omega[k] = 0.5 * (omega[k - 1] + omega[k]);
    return run;
  });
  EXPECT_THAT(answers::named_or_tied(d), testing::IsSupersetOf({"load_torque", "driver_lag"})) << answers::report(d);
  EXPECT_EQ(d.missing.size(), 2U) << answers::report(d);
  EXPECT_NEAR(answers::fitted(d, "tau"), 7e-4, 1e-4);
}

TEST(TimingOfADriver, NamesNoDelayForASecondPole) {
  for (const double second : {0.01, 0.002}) {
    const Diagnosis d = of_a_driver({.first = 0.01, .second = second});
    EXPECT_THAT(answers::named(d), testing::ElementsAre("driver_lag")) << answers::report(d);
  }
}

}  // namespace
}  // namespace emtb::timing_tests
