#include "analysis/record/terminal_lateness.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>

#include "analysis/fit/timing.h"
#include "analysis/record/dataset.h"
#include "analysis/record/reference_row.h"
#include "tests/analysis/synthetic.h"

namespace emtb::terminal_lateness {
namespace {

constexpr double row_time = 0.02, driver_gain = 4, slow = 160, quick = 1e9;  // s, V/V, V/s
constexpr synthetic::Truth motor{.B = 1e-4, .J = 2e-4};

Model with_driver(double slope) {
  Model m = synthetic::servo_model();
  m.driver = DriverModel{.gain = driver_gain, .rise = slope, .fall = slope, .min = -24, .max = 24};
  return m;
}

/// Its driver moves 3.2 V from row to row.
Model slow_driver() { return with_driver(slow); }

/// Steps of 12 rows, and readings as they were so many rows before each row's time.
emtb::Run logged(const std::map<Signal, double>& late, double slope = slow) {
  constexpr std::array levels{0.0, 3.0, -2.0, 1.0, 4.0, -3.0, 0.0};
  constexpr std::size_t rows_a_level = 12, rows = 420, parts = 200;
  const std::map<Signal, double> sigma{
      {Signal::e_a, 0.02}, {Signal::i_a, 0.01}, {Signal::omega, 0.1}, {Signal::theta, 2e-4}};
  std::map<Signal, std::vector<double>> course;  // in parts of a row
  double voltage = 0, omega = 0, theta = 0;
  for (std::size_t k = 0; k < rows * parts; ++k) {
    constexpr double h = row_time / parts;
    const double wanted = driver_gain * levels.at(k / parts / rows_a_level % levels.size());
    const double current = (voltage - motor.K_b * omega) / motor.R_a;
    course[Signal::e_a].push_back(voltage);
    course[Signal::i_a].push_back(current);
    course[Signal::omega].push_back(omega);
    course[Signal::theta].push_back(theta);
    voltage += std::clamp(wanted - voltage, -slope * h, slope * h);
    omega += h * (motor.K_m * current - motor.B * omega) / motor.J;
    theta += h * omega;
  }
  emtb::Run run;
  run.name = "logged";
  synthetic::Noise noise(7);
  for (std::size_t row = 1; row < rows; ++row) {
    const double t = static_cast<double>(row) * row_time;
    run.signals[Signal::u_ref].t.push_back(t);
    run.signals[Signal::u_ref].value.push_back(levels.at(row / rows_a_level % levels.size()));
    for (const auto& [signal, by] : late) {
      const auto at = static_cast<std::size_t>((static_cast<double>(row) - by) * parts);
      run.signals[signal].t.push_back(t);
      run.signals[signal].value.push_back(course[signal][at] + noise(sigma.at(signal)));
    }
  }
  return run;
}

double rows_late(const std::map<Signal, double>& late) {
  const emtb::Run run = logged(late);
  const std::span runs(&run, 1);
  return terminals_are_late(runs, slow_driver(), reference_acts_after(runs, slow_driver()));
}

TEST(TerminalsReadAmidARow, AreLateWhereTheCurrentOrTheMotionCameBefore) {
  for (const Signal other : {Signal::i_a, Signal::omega, Signal::theta}) {
    EXPECT_NEAR(rows_late({{Signal::e_a, 0.4}, {other, 0}}), 0.4, 0.05) << info(other).name;
    EXPECT_NEAR(rows_late({{Signal::e_a, 0.7}, {other, 0}}), 0.7, 0.05) << info(other).name;
  }
}

TEST(TerminalsReadAmidARow, AreLateWhereOneOfTheOthersCameBefore) {
  EXPECT_NEAR(rows_late({{Signal::e_a, 0.4}, {Signal::i_a, 0.4}, {Signal::omega, 0}}), 0.4, 0.05);
}

TEST(TerminalsReadAmidARow, AreInTimeWhereAllAreReadWithThem) {
  EXPECT_EQ(rows_late({{Signal::e_a, 0.4}, {Signal::i_a, 0.4}, {Signal::omega, 0.4}}), 0);
}

TEST(TerminalsReadAmidARow, AreInTimeWhereNothingElseIsRead) { EXPECT_EQ(rows_late({{Signal::e_a, 0.4}}), 0); }

TEST(TerminalsReadAmidARow, DoNotMakeTheMotorLate) {
  Model model = slow_driver();
  Dataset data = prepare(std::vector{logged({{Signal::e_a, 0.4}, {Signal::i_a, 0}, {Signal::omega, 0}})}, {}, model);
  const Calibration fit = calibrate(data, model);
  EXPECT_EQ(data.timing.acts_after, 0);
  EXPECT_EQ(data.timing.late.size(), 1U);
  EXPECT_NEAR(data.timing.late[Signal::e_a], 0.4, 0.05);
  EXPECT_NEAR(fit.model.at(base::R_a).value, motor.R_a, 2 * fit.model.at(base::R_a).std_error.value());
  EXPECT_NEAR(fit.model.at(base::J).value, motor.J, 2 * fit.model.at(base::J).std_error.value());
}

/// The run of a quick driver whose rows hold the reference that was in force until they were read.
emtb::Run with_reference_in_force(emtb::Run run) {
  std::vector<double> reference = run.at(Signal::u_ref).value;
  std::shift_right(reference.begin(), reference.end(), 1);
  run.signals[Signal::u_ref].value = reference;
  return run;
}

TEST(ReferenceInForce, ActsARowBeforeItsOwnAsTheMotionTells) {
  const Model model = with_driver(quick);
  const emtb::Run run = logged({{Signal::e_a, 0}, {Signal::i_a, 0}, {Signal::omega, 0}}, quick);
  EXPECT_EQ(prepare(std::vector{run}, {}, model).timing.acts_after, 0);
  Dataset data = prepare(std::vector{with_reference_in_force(run)}, {}, model);
  EXPECT_NEAR(data.timing.acts_after, -row_time, 0.01 * row_time);
  const Calibration fit = calibrate(data, model);
  EXPECT_NEAR(fit.model.at(base::J).value, motor.J, 3 * fit.model.at(base::J).std_error.value());
  EXPECT_NEAR(fit.model.at(base::K_b).value, motor.K_b, 3 * fit.model.at(base::K_b).std_error.value());
}

TEST(ReferenceInForce, IsNotToldByTerminalsAlone) {
  const emtb::Run run = with_reference_in_force(logged({{Signal::e_a, 0}, {Signal::i_a, 0}}, quick));
  EXPECT_GT(prepare(std::vector{run}, {}, with_driver(quick)).timing.acts_after, -0.01 * row_time);
}

}  // namespace
}  // namespace emtb::terminal_lateness
