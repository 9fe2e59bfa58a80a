#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/discover/between_runs.h"
#include "analysis/discover/changed_runs.h"
#include "analysis/discover/disturbances.h"
#include "analysis/discover/trends.h"
#include "analysis/record/dataset.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

TEST(BetweenRuns, ThreeStandardErrorsAreMoreWhereFewRunsTellThem) {
  EXPECT_NEAR(as_rare_as_three(1e6), 3, 1e-3);
  EXPECT_NEAR(as_rare_as_three(10), 3.96, 0.05);  // Student's t at 0.27 %, two-sided
  EXPECT_NEAR(as_rare_as_three(4), 6.62, 0.25);
}

TEST(BetweenRuns, TakesOffTheErrorsThatTheValuesHaveThemselves) {
  const std::vector<double> off{1, -1, 1, -1}, error{1, 1, 1, 1}, small{0.1, 0.1, 0.1, 0.1};
  EXPECT_NEAR(between_runs(off, error, 1).variance, 1.0 / 3, 1e-9);
  EXPECT_NEAR(between_runs(off, small, 1).variance, 4.0 / 3 - 0.01, 1e-9);
  EXPECT_EQ(between_runs(off, small, 1).freedom, 3);
}

TEST(BetweenRuns, ADriftIsClearOfTheScatterOrNot) {
  const std::vector<double> x{0, 1, 2, 3, 4, 5}, error(6, 0.01);
  const std::vector<double> grows{1.00, 1.03, 1.05, 1.08, 1.11, 1.14}, scatters{1.0, 1.1, 0.95, 1.12, 0.97, 1.1};
  const DriftLine up = line_through(x, grows, error), none = line_through(x, scatters, error);
  EXPECT_TRUE(up.clear());
  EXPECT_NEAR(up.slope, 0.0277, 1e-3);
  EXPECT_NEAR(up.at(5), 1.138, 5e-3);
  EXPECT_LT(up.error_at(2.5), up.error_at(5));
  EXPECT_FALSE(none.clear());
}

/// Four runs of 500 intervals at steady speeds and currents, with a little that is missing everywhere.
WhatIsLeft four_runs() {
  WhatIsLeft left;
  left.torque_scale = 0.1;
  for (int r = 0; r < 4; ++r) {
    MissingTorque run;
    run.run = "run " + std::to_string(r);
    for (int k = 0; k < 500; ++k) {
      run.t.push_back(0.01 * k);
      run.torque.push_back(1e-4 * std::sin(7.0 * k + r));
      run.torque_error.push_back(1e-4);
      run.omega.push_back(k < 250 ? 100 : 60);
      run.i_a_smoothed.push_back(k < 250 ? 1 : 0.5);
    }
    left.runs.push_back(run);
  }
  return left;
}

void push(MissingTorque& run, int from, int to, double torque) {
  for (int k = from; k < to; ++k) run.torque[static_cast<std::size_t>(k)] += torque;
}

TEST(Disturbances, ATorqueThatActsForAWhileIsFoundWithItsTime) {
  WhatIsLeft left = four_runs();
  push(left.runs[2], 100, 130, -0.01);
  const std::vector<Disturbance> found = disturbances_in(left);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].run, "run 2");
  EXPECT_NEAR(found[0].from_s, 1.0, 0.02);
  EXPECT_NEAR(found[0].to_s, 1.3, 0.02);
  EXPECT_NEAR(found[0].torque, -0.01, 1e-3);
}

TEST(Disturbances, AreFoundWhereTheirSpeedAndCurrentComeApartOnly) {
  WhatIsLeft left = four_runs();
  push(left.runs[1], 300, 330, -0.03);
  for (std::size_t k = 300; k < 330; ++k)
    left.runs[1].i_a_smoothed[k] = 1;  // 1 A comes with 100 rad/s elsewhere, not with 60
  const std::vector<Disturbance> found = disturbances_in(left);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].from_s, 3.0, 0.02);
}

TEST(Disturbances, AreFoundThatSoonDriveTheShaftWhereItNeverIsWithoutThem) {
  WhatIsLeft left = four_runs();
  push(left.runs[2], 100, 130, -0.05);
  for (std::size_t k = 104; k < 130; ++k) left.runs[2].omega[k] = -40, left.runs[2].i_a_smoothed[k] = 3;
  const std::vector<Disturbance> found = disturbances_in(left);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_NEAR(found[0].from_s, 1.0, 0.02);
  EXPECT_NEAR(found[0].to_s, 1.3, 0.02);
  for (std::size_t k = 100; k < 104; ++k) left.runs[2].omega[k] = -40, left.runs[2].i_a_smoothed[k] = 3;
  EXPECT_TRUE(disturbances_in(left).empty()) << "it may be a law of a speed that comes once";
}

TEST(Disturbances, AreFoundBesideSoMuchSmallerOnesThatTheseLastTooLong) {
  WhatIsLeft left = four_runs();
  push(left.runs[0], 20, 50, 0.05);
  for (std::size_t r = 1; r < 4; ++r) {
    for (const int from : {20, 120}) push(left.runs[r], from, from + 20, -0.003);
  }
  const std::vector<Disturbance> found = disturbances_in(left);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].run, "run 0");
}

TEST(Disturbances, InSeveralRunsDoTheSameAndSeldom) {
  const auto found = [](double in_another, int runs) {
    WhatIsLeft left = four_runs();
    for (int r = 4; r < runs; ++r) left.runs.push_back(left.runs[0]), left.runs.back().run = "run " + std::to_string(r);
    push(left.runs[0], 100, 120, -0.01);
    push(left.runs[1], 300, 320, in_another);
    return disturbances_in(left).size();
  };
  EXPECT_EQ(found(-0.012, 6), 2U);
  EXPECT_EQ(found(-0.012, 4), 0U) << "in half of the runs";
  EXPECT_EQ(found(0.012, 6), 0U) << "the other way";
  EXPECT_EQ(found(-0.03, 6), 0U) << "much more";
}

TEST(Disturbances, OfAHandInOneRunAreAsItLikes) {
  WhatIsLeft left = four_runs();
  push(left.runs[0], 100, 120, -0.01);
  push(left.runs[0], 300, 320, 0.03);
  EXPECT_EQ(disturbances_in(left).size(), 2U);
}

TEST(Disturbances, WhatComesAgainAtTheSameStatesIsNone) {
  WhatIsLeft left = four_runs();
  for (MissingTorque& run : left.runs) {
    push(run, 100, 130, -0.01);
    for (std::size_t k = 100; k < 130; ++k) run.omega[k] = 20;  // a law of the speed
  }
  EXPECT_TRUE(disturbances_in(left).empty());
}

TEST(Disturbances, WhatIsNextToNothingBesideTheMotorsTorqueIsNone) {
  WhatIsLeft left = four_runs();
  left.torque_scale = 10;
  push(left.runs[2], 100, 130, -0.01);
  EXPECT_TRUE(disturbances_in(left).empty());
}

TEST(Disturbances, WhatLastsLongIsNone) {
  WhatIsLeft left = four_runs();
  push(left.runs[0], 10, 200, -0.01);
  EXPECT_TRUE(disturbances_in(left).empty());
}

TEST(Disturbances, ARunWithoutOneIsTwoRuns) {
  emtb::Run run;
  run.name = "a.csv";
  for (const Signal signal : {Signal::e_a, Signal::omega}) {
    for (int k = 0; k < 1000; ++k) {
      run.signals[signal].t.push_back(0.01 * k);
      run.signals[signal].value.push_back(k);
    }
  }
  const std::vector<Disturbance> one{{"a.csv", 4, 5, 0.1}}, elsewhere{{"b.csv", 4, 5, 0.1}},
      early{{"a.csv", 0.5, 5, 0.1}};
  const std::vector<emtb::Run> runs{run};
  const std::vector<emtb::Run> pieces = without_disturbances(runs, one, Signal::e_a);
  ASSERT_EQ(pieces.size(), 2U);
  EXPECT_EQ(pieces[0].name, "a.csv@:4");
  EXPECT_EQ(pieces[1].name, "a.csv@5:");
  EXPECT_EQ(pieces[0].at(Signal::omega).value.size(), 400U);
  EXPECT_EQ(pieces[1].at(Signal::omega).value.front(), 500);
  EXPECT_TRUE(is_of_disturbed_run(pieces[1].name, one[0]));
  EXPECT_FALSE(is_of_disturbed_run("a.csv2", one[0]));
  EXPECT_EQ(without_disturbances(runs, elsewhere, Signal::e_a).size(), 1U);
  EXPECT_EQ(without_disturbances(runs, early, Signal::e_a).size(), 1U) << "half a second is no run";
}

/// The training runs of the servo, each with an armature of its own.
std::vector<Record> with_resistances(const std::vector<double>& factors) {
  const blind::Bench bench = blind::fast_bench();
  std::vector<Run> runs;
  for (std::size_t r = 0; r < factors.size(); ++r) {
    blind::Bench here = bench;
    here.plant.motor.R_a *= factors[r];
    runs.push_back(record(here, bench.train[r % 2], 10 + r));
    runs.back().name = "run " + std::to_string(r);
  }
  return prepare(runs, {}, bench.model).train;
}

Model fitted_to(const std::vector<Record>& records) {
  return calibrate(records, blind::fast_bench().model, {.extra_starts = 0, .with_covariance = false}).model;
}

/// The only change among runs with such resistances.
Changed only_change(const std::vector<double>& factors) {
  const std::vector<Record> records = with_resistances(factors);
  const std::vector<Changed> changed = changed_runs(records, fitted_to(records));
  EXPECT_EQ(changed.size(), 1U);
  return changed.empty() ? Changed{} : changed[0];
}

TEST(ChangedRuns, TellFromWhichRunOnTheResistanceIsAnotherOne) {
  const Changed changed = only_change({1, 1, 1, 1.1, 1.1, 1.1});
  EXPECT_EQ(changed.how, ChangeOf::from_here_on);
  EXPECT_EQ(changed.parameter, "R_a");
  EXPECT_EQ(changed.run, "run 3");
  EXPECT_EQ(changed.runs.size(), 3U);
  EXPECT_NEAR(changed.to / changed.from, 1.1, 0.02);
}

TEST(ChangedRuns, TellOfAResistanceThatGrowsThroughTheDay) {
  const Changed changed = only_change({1, 1.04, 1.08, 1.12, 1.16, 1.2});
  EXPECT_EQ(changed.how, ChangeOf::drift);
  EXPECT_EQ(changed.parameter, "R_a");
  EXPECT_NEAR(changed.to / changed.from, 1.2, 0.03);
}

TEST(ChangedRuns, SayNothingOfOneMachineNorOfThreeRuns) {
  const std::vector<Record> one_machine = with_resistances({1, 1, 1, 1, 1});
  EXPECT_THAT(changed_runs(one_machine, fitted_to(one_machine)), testing::IsEmpty());
  const std::vector<Record> three = with_resistances({1, 1, 1.2});
  EXPECT_THAT(changed_runs(three, fitted_to(three)), testing::IsEmpty());
}

TEST(Trends, AParameterThatGrowsFromSessionToSessionHasALineWithABand) {
  const std::vector<Record> records = with_resistances({1, 1.05, 1.1, 1.15});
  std::vector<std::vector<Record>> groups;
  for (const Record& r : records) groups.push_back({r});
  const std::vector<Trend> found = trends(groups, {"a", "b", "c", "d"}, fitted_to(records));
  const auto resistance = std::ranges::find(found, "R_a", &Trend::parameter);
  ASSERT_NE(resistance, found.end());
  ASSERT_EQ(resistance->points.size(), 4U);
  EXPECT_NEAR(resistance->whole, 0.15 / 1.075, 0.03);
  for (const TrendPoint& p : resistance->points) EXPECT_GT(p.line_error, 0) << p.run;
  EXPECT_NEAR(resistance->points[3].line, resistance->points[3].value, 0.03 * resistance->points[3].value);
}

}  // namespace
}  // namespace emtb
