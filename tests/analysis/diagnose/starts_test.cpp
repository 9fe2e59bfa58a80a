// Runs that begin on the way: while the shaft turns and the driver is on its slope to a reference set before.
#include "analysis/fit/starts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/timing.h"
#include "model/catalogue.h"
#include "model/simulation.h"
#include "session/spec.h"
#include "tests/blind/recording.h"

namespace emtb::starts_tests {
namespace {

using testing::IsEmpty;

class BeginningOnTheWay : public testing::Test {
 protected:
  blind::Bench bench = blind::slow_bench();

  void without(Signal signal) {
    std::erase_if(bench.channels, [&](const simulated::DaqChannel& c) { return c.signal == signal; });
  }

  std::vector<emtb::Run> runs(bool held_out) const {
    constexpr double late = 0.5;  // [s] after its reference has first changed a run begins: the driver takes seconds
    std::vector<emtb::Run> all = record(bench, held_out ? bench.held_out : bench.train, held_out ? 101 : 1);
    for (emtb::Run& run : all) {
      const Series& u_ref = run.at(Signal::u_ref);
      const auto changed = std::ranges::find_if(u_ref.value, [&](double u) { return u != u_ref.value.front(); });
      const double begins = u_ref.t[static_cast<std::size_t>(changed - u_ref.value.begin())] + late;
      run = cut(run, begins, u_ref.t.back());
    }
    return all;
  }

  Diagnosis diagnosis() const { return diagnose(runs(false), runs(true), bench.model); }
};

TEST_F(BeginningOnTheWay, IsNoEffectOfTheDriverWhereItsVoltageIsRead) {
  const Diagnosis d = diagnosis();
  EXPECT_THAT(d.missing, IsEmpty());
  EXPECT_LE(d.final_held_out, 1.1);
}

TEST_F(BeginningOnTheWay, IsNoEffectOfTheDriverWhereNobodyReadsIt) {
  bench.slow_meter = false;  // the first of its means began before the run
  without(Signal::e_a);
  const Diagnosis d = diagnosis();
  EXPECT_THAT(d.missing, IsEmpty());
  EXPECT_LE(d.final_held_out, 1.15);
  EXPECT_TRUE(d.data->train.front().excitation.initial.e_driver);
}

TEST_F(BeginningOnTheWay, IsNoFasterThanWhatIsReadWhereAMotorForgetsItAtOnce) {
  without(Signal::e_a);
  without(Signal::i_a);
  bench.slow_meter = false;
  Model light = bench.model;
  light.driver->rise = light.driver->fall = DriverModel::unlimited;
  light.base[base::J].value = 1e-6;  // a time constant of 0.1 ms, where rows are 5 ms apart
  Dataset data = prepare(runs(false), {}, light);
  settle_starts(data, light);
  for (const Record& record : data.train) {
    const std::vector<double>& speed = record.find(Signal::omega)->value;
    const auto [low, high] = std::ranges::minmax(speed);
    EXPECT_LE(std::abs(record.excitation.initial.omega), 2.01 * std::max(std::abs(low), std::abs(high))) << record.name;
  }
}

TEST_F(BeginningOnTheWay, SettlesNothingWhereRunsBeginAtRest) {
  without(Signal::e_a);
  Dataset data = prepare(record(bench, bench.train, 1), {}, bench.model);
  EXPECT_FALSE(settle_starts(data, bench.model));
  EXPECT_EQ(data.train.front().excitation.initial.omega, 0);
}

/// A toy motor of 30 ms behind a sine, the speed of which is counted twenty times a second, already turning as the run
/// begins; dry friction takes a tenth of its torque.
emtb::Run counted(const std::string& name, double mean, double swing, double period, double seconds) {
  constexpr double row = 0.05, step = 1e-3, count = 2 * std::numbers::pi / 12;
  ModelStructure toy;
  toy.effects = {effect_index("coulomb_friction")};
  const std::vector<double> values{27.4, 0.011, 0.011, 0, 1.3e-7, 1.9e-4};
  Excitation x;
  for (double t = -1; t < seconds; t += step) {
    x.t.push_back(t + 1);
    x.u_ref.push_back(
        std::round(50 * (mean + swing * std::sin(2 * std::numbers::pi * std::floor(t / row) * row / period))) / 50);
  }
  Trajectory<double> y;
  simulate<double>(toy, values, x, y);
  std::vector<double> t, reference, speed;
  const auto rows_apart = static_cast<std::size_t>(row / step + 0.5);
  for (std::size_t k = 1000; k < x.t.size(); k += rows_apart) {
    t.push_back(x.t[k] - 1);
    reference.push_back(x.u_ref[k]);
    speed.push_back((std::floor(y.theta[k] / count) - std::floor(y.theta[k - rows_apart] / count)) * count / row);
  }
  emtb::Run run;
  run.name = name;
  run.signals[Signal::u_ref] = {.t = t, .value = reference, .source = {}};
  run.signals[Signal::omega] = {.t = t, .value = speed, .source = {}};
  return run;
}

TEST(ABeginningThatIsForgottenInARow, MendsNothingThatTheModelLacks) {
  Model toy = blind::slow_bench().model;
  toy.driver = DriverModel{.min = 0, .max = 5};
  toy.tie = {{"K_m", "K_b"}};
  const auto set = [&](std::size_t place, double value, double min, double max) {
    Parameter& p = toy.base[place];
    p.value = value, p.min = min, p.max = max, p.prior = {}, p.fixed = min == max;
  };
  set(base::R_a, 27.4, 27.4, 27.4);
  set(base::K_b, 0.0109, 0.003, 0.05);
  set(base::B, 1.8e-7, 0, 1e-4);
  set(base::J, 1.8e-7, 1.8e-7, 1.8e-7);
  const std::vector<emtb::Run> train{counted("long", 2.2, 2.0, 12, 12), counted("short", 2.5, 0.8, 3, 7)};
  const std::vector<emtb::Run> held_out{counted("other", 2.4, 1.6, 7, 12)};
  Dataset data = prepare(train, held_out, toy);
  const Calibration before = calibrate(std::span<const Record>(data.train), toy, {});
  const Calibration after = calibrate(data, toy, {});
  EXPECT_GT(error_of(mean_squares(residuals(data.train, after.model, after.model.values(), {}))), 5) << "friction";
  EXPECT_LE(after.cost, 1.001 * before.cost);
}

}  // namespace
}  // namespace emtb::starts_tests
