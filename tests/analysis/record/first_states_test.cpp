#include "analysis/record/first_states.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/record/record.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::series;
using synthetic::servo_model;

/// Named, and without any signal yet.
emtb::Run a_run() {
  emtb::Run run;
  run.name = "begins.csv#a";
  return run;
}

TEST(FirstStates, AreAsMeansOverARowTellButNotAsMeansOverMany) {
  emtb::Run run = a_run();
  run.signals[Signal::u_ref] = series(1e-3, 2, [](double) { return 2.0; });
  run.signals[Signal::omega] = series(1e-3, 2, [](double t) { return 120 - 50 * t; });
  run.signals[Signal::e_a] = series(1e-3, 2, [](double t) { return std::min(8.0, 30 * t); });
  const auto start = [&](double window) {
    run.signals[Signal::omega].window = run.signals[Signal::e_a].window = window;
    return observe_run(run, servo_model()).excitation.initial;
  };
  EXPECT_NEAR(start(1e-3).omega, 120, 0.3);
  EXPECT_NEAR(start(1e-3).e_driver.value_or(8), 0, 0.05) << "the driver is on its slope";
  EXPECT_EQ(start(0.2).omega, 0);
  EXPECT_FALSE(start(0.2).e_driver);
}

TEST(FirstStates, AreAsASpeedTellsThatStandsInSeveralRows) {
  constexpr double a_reading = 5e-3;  // [s] stands in five rows, and so does each step of the input
  emtb::Run run = a_run();
  const auto level = [&](double t) { return 1.0 + std::floor((t + 1e-6) / a_reading); };
  run.signals[Signal::u_ref] = series(1e-3, 0.2, level);
  run.signals[Signal::omega] = series(1e-3, 0.2, [&](double t) { return 20 * level(t); });
  EXPECT_NEAR(observe_run(run, servo_model()).excitation.initial.omega, 20, 1e-6);
  run.signals[Signal::omega] = series(1e-3, 0.2, [&](double t) { return 20 * (level(t) - 1); });
  EXPECT_EQ(observe_run(run, servo_model()).excitation.initial.omega, 0);
}

TEST(FirstStates, HaveADriverAtNothingWhereAShaftAtRestIsFirstAskedToTurn) {
  emtb::Run run = a_run();
  run.signals[Signal::u_ref] = series(1e-3, 2, [](double) { return 2.0; });
  run.signals[Signal::omega] = series(1e-3, 2, [](double t) { return t < 0.5 ? 0.0 : 180.0; });
  const auto driver = [&] { return observe_run(run, servo_model()).excitation.initial.e_driver.value_or(8); };
  EXPECT_EQ(driver(), 0);
  run.signals[Signal::i_a] = series(1e-3, 2, [](double) { return 0.5; });
  EXPECT_EQ(driver(), 8) << "a current flows: something holds the shaft";
  run.signals[Signal::i_a] = series(1e-3, 2, [](double t) { return t; });
  EXPECT_EQ(driver(), 0);
  run.signals[Signal::omega] = series(1e-3, 2, [](double) { return 180.0; });
  EXPECT_EQ(driver(), 8) << "it is on its way";
}

}  // namespace
}  // namespace emtb
