#include "analysis/diagnose/compare.h"

#include <gtest/gtest.h>

#include <cmath>

#include "analysis/fit/residuals.h"
#include "analysis/fit/timing.h"
#include "model/catalogue.h"
#include "model/simulation.h"
#include "tests/analysis/own_record.h"

namespace emtb {
namespace {

using synthetic::OwnRecord;
using synthetic::true_servo;

/// The floors of a servo's own record.
Noise own_floors() {
  return {{Signal::omega, {.sigma = OwnRecord::sigma_omega, .from = FloorSource::declared}},
          {Signal::i_a, {.sigma = OwnRecord::sigma_i_a, .from = FloorSource::declared}}};
}

/// The fit of the speed where its reading errs as a function of (t, omega) says.
template <class Error>
SignalFit fit_of_speed(const Error& error) {
  OwnRecord own(true_servo());
  return fit_of(own.with_error(Signal::omega, error), true_servo(), own_floors()).at(Signal::omega);
}

TEST(FitOf, IsAHundredPercentWhereNothingIsLeft) {
  const SignalFit fit = fit_of_speed([](double, double) { return 0.0; });
  EXPECT_NEAR(fit.fit_percent, 100, 1e-9);
  EXPECT_NEAR(fit.rmse, 0, 1e-9);
}

TEST(FitOf, IsWhatIsLeftOverTheSpreadOfTheReadings) {
  OwnRecord own(true_servo());
  const std::vector<Record>& records = own.with_error(Signal::omega, [](double, double) { return 5.0; });
  double sum = 0, squares = 0, n = 0;
  for (const Observation& o : records[0].observations) {
    if (o.signal != Signal::omega) continue;
    for (const double v : o.value) sum += v, squares += v * v, n += 1;
  }
  ASSERT_EQ(n, 1000);
  const double spread = std::sqrt(squares / n - std::pow(sum / n, 2));
  const SignalFit fit = fit_of(records, true_servo(), own_floors()).at(Signal::omega);
  EXPECT_NEAR(fit.rmse, 5, 1e-9) << "[rad/s]";
  EXPECT_NEAR(fit.ratio, 5 / OwnRecord::sigma_omega, 1e-9);
  EXPECT_NEAR(fit.fit_percent, 100 * (1 - 5 / spread), 1e-6);
  EXPECT_EQ(fit.noise.from, FloorSource::declared);
}

TEST(FitOf, IsNoneWhereTheSpeedIsNoBetterThanItsMean) {
  // The reading is half of what the model says: the model errs by as much as the reading spreads.
  const SignalFit fit = fit_of_speed([](double, double omega) { return -0.5 * omega; });
  EXPECT_NEAR(fit.fit_percent, 0, 2) << "but for the little that the mean is off zero";
}

TEST(FitOf, SaysWhetherASignalMovesAtAll) {
  OwnRecord own(true_servo());
  std::vector<Record> records = own.with_noise(3);
  EXPECT_TRUE(fit_of(records, true_servo(), own_floors()).at(Signal::omega).moves);
  for (Observation& o : records[0].observations) {
    if (o.signal != Signal::omega) continue;
    o.value = synthetic::coloured(o.value.size(), 0, 4);
    for (double& v : o.value.edit()) v *= OwnRecord::sigma_omega;  // a gauge that nothing loads
  }
  EXPECT_FALSE(fit_of(records, true_servo(), own_floors()).at(Signal::omega).moves);
}

TEST(FitOf, NothingIsLeftBesideTheInstrumentWhereTheModelIsRight) {
  OwnRecord own(true_servo());
  for (const auto& [signal, fit] : fit_of(own.with_noise(3), true_servo(), own_floors())) {
    EXPECT_EQ(fit.rest.rms, 0) << info(signal).name;
  }
}

TEST(FitOf, WhatIsLeftOfTheSpeedIsLikeTheTorqueThatTheModelDoesNotKnow) {
  const Model model = true_servo();
  OwnRecord own(model);
  std::vector<Record> records = own.records();
  const double torque = 3e-3, memory = 0.3;  // [N m], [s] a random push, 8 % of what the motor gives
  Record pushed = records[0];
  pushed.measured_load = true;
  const double interval = pushed.excitation.t[1] - pushed.excitation.t[0];
  pushed.excitation.load = synthetic::coloured(pushed.length(), std::exp(-interval / memory), 5);
  for (double& load : pushed.excitation.load.edit()) load *= torque;
  Trajectory<double> y;
  simulate<double>(pushed.structure(model), model.values(), pushed.excitation, y);
  synthetic::Noise noise(8);
  for (Observation& o : records[0].observations) {
    for (std::size_t k = 0; k < o.size(); ++k)
      o.value.edit()[k] = reading_of(o.signal, y)[o.last[k]] + noise(o.sigma[k]);
  }
  const Rest rest = fit_of(records, model, own_floors()).at(Signal::omega).rest;
  EXPECT_NEAR(rest.like, torque, 0.3 * torque);
  EXPECT_GT(rest.lasts, memory) << "twice the memory of the push, and the shaft's own";
  EXPECT_LT(rest.lasts, 5 * memory);
  EXPECT_GT(rest.applied, rest.like);
}

TEST(FitOf, WhatIsLeftIsNoTorqueWhereItIsAnotherInEachReading) {
  OwnRecord own(true_servo());
  std::vector<Record> records = own.with_noise(3);
  synthetic::Noise more(4);
  for (Observation& o : records[0].observations) {
    for (std::size_t k = 0; k < o.size(); ++k) o.value.edit()[k] += more(2 * o.sigma[k]);
  }
  const Rest rest = fit_of(records, true_servo(), own_floors()).at(Signal::omega).rest;
  EXPECT_GT(rest.rms, 0);
  EXPECT_TRUE(rest.hops);
  EXPECT_EQ(rest.like, 0);
}

/// A servo's run with the voltage measured, and a gauge that reads no load.
Run whole_run() {
  constexpr double sigma_torque = 1e-4;  // [N m]
  Run run = synthetic::record({}, synthetic::steps, 1e-3, {.omega = 0.5, .i_a = 0.05, .e_a = 0.05});
  synthetic::Noise noise(7);
  Series torque = run.at(Signal::omega);
  for (double& v : torque.value.edit()) v = noise(sigma_torque);
  run.signals[Signal::torque] = torque;
  return run;
}

std::optional<Unit> failing_unit(const Model& model) {
  const std::vector<Run> runs{whole_run()};
  Model judge = true_servo();
  judge.noise = {{Signal::omega, 0.5}, {Signal::i_a, 0.05}, {Signal::e_a, 0.05}, {Signal::torque, 1e-4}};
  return compare(runs, model, judge).failing_unit;
}

TEST(FailingUnit, IsNoneWhereAllAreRight) { EXPECT_EQ(failing_unit(true_servo()), std::nullopt); }

TEST(FailingUnit, IsTheDriverWhoseVoltageIsOff) {
  Model model = true_servo();
  model.driver->gain *= 1.1;
  EXPECT_EQ(failing_unit(model), Unit::driver) << "the motor is driven by what was measured";
}

TEST(FailingUnit, IsTheMotorWhoseSpeedIsOff) {
  Model model = true_servo();
  model.at(4).value *= 1.2;  // J
  EXPECT_EQ(failing_unit(model), Unit::motor);
}

TEST(FailingUnit, IsTheLoadThatTheGaugeDoesNotRead) {
  Model model = true_servo();
  model.include(effect_index("eddy_brake"));
  model.parameters_of(effect_index("eddy_brake"))[0].value = 0.01;  // [N m]
  EXPECT_EQ(failing_unit(model), Unit::load) << "the shaft is loaded by what was measured";
}

TEST(Compare, TakesNoCoarseSpeedThatBeginsOnTheWayForAnotherTiming) {
  constexpr double coarse = 4, turns = -9, noise_of_current = 1e-3;  // [rad/s], [rad/s], [A]
  Model model = true_servo();
  model.driver = DriverModel{.gain = 4};
  Excitation x;
  for (int k = 0; k < 400; ++k) {
    x.t.push_back(0.01 * k);
    x.u_ref.push_back(k < 200 ? -0.8 : 0.2);
  }
  x.initial.omega = turns;
  Trajectory<double> y;
  simulate<double>(model.structure(), model.values(), x, y);
  emtb::Run run;
  run.name = "on_the_way";
  const auto put = [&](Signal signal, std::span<const double> values, const auto& read) {
    Series& series = run.signals[signal];
    for (std::size_t k = 0; k < values.size(); ++k) {
      series.t.push_back(x.t[k]);
      series.value.push_back(read(values[k]));
    }
  };
  synthetic::Noise noise(3);
  put(Signal::u_ref, x.u_ref, [](double v) { return v; });
  put(Signal::omega, y.omega, [](double v) { return coarse * std::round(v / coarse); });
  put(Signal::i_a, y.i_a, [&](double v) { return v + noise(noise_of_current); });
  run.signals[Signal::omega].lsb = coarse;
  const Comparison c = compare(std::span(&run, 1), model);
  EXPECT_EQ(c.timing.acts_after, 0);
  EXPECT_LT(c.error, 1.1);
  EXPECT_NEAR(c.chained_error, c.error, 0.01) << "it begins as the other does";
}

TEST(Compare, TellsTheSameErrorOfRunsHeldOutAsTheFitThatTheyWereHeldOutOf) {
  const std::vector<emtb::Run> train{whole_run()};
  const std::vector<emtb::Run> held_out{
      synthetic::record({}, {{0.2, 0}, {1, 4}, {0.8, -2}}, 1e-3, {0.3, 0.03, 0.03}, 2)};
  Model given = synthetic::servo_model();
  Dataset data = prepare(train, held_out, given);
  const Model fitted = calibrate(data, given).model;
  const double error = error_of(mean_squares(residuals(data.held_out, fitted, fitted.values(), {})));
  EXPECT_NEAR(compare(held_out, fitted, given, train).error, error, 1e-3 * error);
}

}  // namespace
}  // namespace emtb
