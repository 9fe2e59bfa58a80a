// Runs that begin on the way: while the shaft turns and the driver is on its slope to a reference set before.
#include "analysis/fit/starts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis/diagnose/diagnose.h"
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

}  // namespace
}  // namespace emtb::starts_tests
