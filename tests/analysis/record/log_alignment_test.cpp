#include "analysis/record/log_alignment.h"

#include <gmock/gmock.h>

#include <cmath>
#include <functional>
#include <random>

#include "hal/error.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;

constexpr double log_window = 0.4;  // [s]

/// A run of the FH2 motor with dry friction under a voltage that a slow driver makes, and the log that a meter's own
/// software would have written of its current.
struct LoggedRun {
  Run run;
  Series log;
};

/// @param e_a [V] over time @param offset [s] of the log's clock in the middle, t = t_log + offset @param drift of it
LoggedRun logged(const std::function<double(double)>& e_a, double duration, double offset, double drift) {
  constexpr double resistance = 31.8, constant = 0.67, viscous = 1e-4, inertia = 3.4e-3, dry = 0.055, step = 1e-3;
  std::mt19937 random(42);
  std::normal_distribution<double> noise;
  LoggedRun made;
  double omega = 0;
  double charge = 0;
  double from = 0.13;  // [s] the meter began whenever it began
  for (double t = 0; t < duration; t += step) {
    const double current = (e_a(t) - constant * omega) / resistance;
    const double torque = constant * current - viscous * omega;
    omega += step / inertia * (omega > 0 || torque > dry ? torque - dry : 0);
    omega = std::max(omega, 0.0);
    made.run.signals[Signal::omega].t.push_back(t);
    made.run.signals[Signal::omega].value.push_back(omega + 0.2 * noise(random));
    if (t < from) continue;
    charge += current * step;
    if (t - from >= log_window) {
      made.log.t.push_back(t);
      made.log.value.push_back(std::round(charge / (t - from) * 1000) / 1000);  // 1 mA a digit
      charge = 0;
      from = t;
    }
  }
  const double middle = (made.log.t.front() + made.log.t.back()) / 2;  // of the run's time: near enough for the drift
  for (double& t : made.log.t.edit()) t = t - offset - drift * (t - middle);
  made.log.window = log_window;
  return made;
}

double two_ramps(double t) {
  const double up = std::clamp(22.5 * (t - 2), 0.0, 100.0);
  const double down = std::clamp(20.4 * (t - 17), 0.0, 60.0);
  const double again = std::clamp(22.5 * (t - 30), 0.0, 45.0);
  return up - down + again;
}

std::string refused_log(const LoggedRun& made) {
  try {
    align_log(made.run, made.log);
  } catch (const SessionError& e) {
    return e.what();
  }
  return "";
}

TEST(LogAlignment, FindsAKnownOffset) {
  for (const double offset : {-1234.567, 0.0, 3.217}) {
    const LoggedRun made = logged(two_ramps, 45, offset, 0);
    const LogAlignment found = align_log(made.run, made.log);
    EXPECT_NEAR(found.offset, offset, 4 * found.offset_error) << found.offset_error;
    EXPECT_LT(found.offset_error, 0.1) << "a quarter of a window";
    EXPECT_GT(found.explained, 0.95);
  }
}

TEST(LogAlignment, FindsTheDriftOfALongLog) {
  const auto long_run = [](double t) { return two_ramps(t) + two_ramps(t - 300) / 2 - two_ramps(t - 571) / 3; };
  const LoggedRun made = logged(long_run, 620, 7.5, 200e-6);
  const LogAlignment found = align_log(made.run, made.log);
  EXPECT_NEAR(found.offset, 7.5, std::max(4 * found.offset_error, 0.02));
  ASSERT_GT(found.drift_error, 0) << "it can be told";
  EXPECT_NEAR(found.drift, 200e-6, std::max(4 * found.drift_error, 50e-6));
}

TEST(LogAlignment, LeavesADriftThatAShortLogCannotTellAtNone) {
  const LoggedRun made = logged(two_ramps, 45, 3.2, 100e-6);
  const LogAlignment found = align_log(made.run, made.log);
  EXPECT_EQ(found.drift, 0);
  EXPECT_EQ(found.drift_error, 0);
}

TEST(LogAlignment, PlacesTheReadingsThatLieInTheRun) {
  LoggedRun made = logged(two_ramps, 45, 3.217, 0);
  made.log.t.insert(made.log.t.begin(), made.log.t.front() - 30);  // before anyone recorded
  made.log.value.insert(made.log.value.begin(), 0.0);
  const Series series = placed(made.run, made.log, {.offset = 3.217});
  ASSERT_EQ(series.t.size(), made.log.t.size() - 1);
  EXPECT_NEAR(series.t.front(), 0.53, 2e-3);
  EXPECT_EQ(series.window, log_window);
}

TEST(LogAlignment, RefusesWhatFitsInMoreThanOnePlace) {
  const auto square = [](double t) { return std::fmod(t, 8) < 4 ? 60.0 : 0.0; };
  EXPECT_THAT(refused_log(logged(square, 60, 1, 0)), HasSubstr("the run repeats itself"));
}

TEST(LogAlignment, RefusesALogOfSomethingElse) {
  LoggedRun made = logged(two_ramps, 45, 1, 0);
  std::mt19937 random(3);
  for (double& value : made.log.value.edit()) value = 0.001 * static_cast<double>(random() % 1000);
  EXPECT_THAT(refused_log(made), HasSubstr("does not look like the run anywhere"));
  std::ranges::fill(made.log.value.edit(), 0.5);
  EXPECT_THAT(refused_log(made), HasSubstr("never changes"));
  made.log.t.resize(5);
  made.log.value.resize(5);
  EXPECT_THAT(refused_log(made), HasSubstr("5 readings; 12 are the least"));
  made.run.signals.clear();
  EXPECT_THAT(refused_log(made), HasSubstr("neither omega nor e_a"));
}

}  // namespace
}  // namespace emtb
