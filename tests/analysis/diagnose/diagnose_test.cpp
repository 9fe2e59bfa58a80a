#include "analysis/diagnose/diagnose.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/refit.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/timing.h"
#include "analysis/numerics/parallel.h"
#include "model/catalogue.h"
#include "tests/analysis/diagnose/answers.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using namespace answers;
using testing::Contains;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::UnorderedElementsAre;

/// Runs without their first three seconds: the start from rest.
std::vector<emtb::Run> under_way(std::vector<emtb::Run> runs) {
  for (emtb::Run& run : runs) {
    for (auto& [signal, s] : run.signals) {
      const auto first = std::ranges::lower_bound(s.t, 3.0) - s.t.begin();
      s.t.erase(s.t.begin(), s.t.begin() + first);
      s.value.erase(s.value.begin(), s.value.begin() + first);
      for (double& t : s.t.edit()) t -= 3;
    }
  }
  return runs;
}

TEST(Diagnose, FindsNothingWhereNothingIsHiddenOnTheSlowBench) {
  const Diagnosis d = diagnose_on(blind::slow_bench());
  EXPECT_EQ(d.verdict, Verdict::nothing_missing) << report(d);
  EXPECT_THAT(named(d), IsEmpty());
  EXPECT_LE(d.final_held_out, 1.1);
}

TEST(Diagnose, FindsNothingWhereNothingIsHiddenOnTheFastBench) {
  const Diagnosis d = diagnose_on(blind::fast_bench());
  EXPECT_EQ(d.verdict, Verdict::nothing_missing) << report(d);
  EXPECT_THAT(named(d), IsEmpty());
}

TEST(Diagnose, FitsARunThatAloneShowsWhatIsMissingAndSaysSo) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.max = 14;  // V; the model's driver goes to 24, the training runs to 12
  const std::vector<Profile> all = bench.train;
  bench.train = {all[0], all[3]};
  bench.held_out = {step("high", 5, 0.5, 2.5, 1), step("low", 2.5, 0.5, 2.5, 1)};
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("driver_saturation")) << report(d);
  EXPECT_THAT(d.fitted_too, ElementsAre("high"));
  EXPECT_THAT(d.shown_by, IsEmpty());
  EXPECT_EQ(d.data->held_out.size(), 1) << "low judges still";
  bench.train.push_back(bench.held_out[0]);
  EXPECT_THAT(diagnose_on(bench).fitted_too, IsEmpty());
}

TEST(Diagnose, FindsWhatOnlyTrainingRunsShow) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.max = 14;  // V; the model's driver goes to 24, the held-out runs to 10
  bench.train = {step("high", 5, 0.5, 2.5, 1), step("higher", 5.5, 0.5, 2, 1), bench.train[0]};
  bench.held_out = {step("low", 2.5, 0.5, 2.5, 1)};
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("driver_saturation")) << report(d);
  EXPECT_TRUE(d.only_training_shows_it());
  EXPECT_LE(d.final_train, 1.1);
  EXPECT_NEAR(d.base_held_out, d.final_held_out, 0.1) << "the run that was named shows nothing of it";
  EXPECT_FALSE(diagnose_on(blind::fast_bench()).only_training_shows_it());
}

// The held-out runs of one show a little of a limit that the training runs are full of, and the other way round.
TEST(Diagnose, AsksTheTrainingRunsWhereTheyShowFarMoreThanTheHeldOutRun) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.max = 14;  // [V]; the model's driver goes to 24
  const std::vector<Profile> full{step("high", 5, 0.5, 2.5, 1), step("higher", 5.5, 0.5, 2, 1)},
      little{step("hardly", 3.55, 0.5, 2.5, 1), step("low", 2, 0.5, 2.5, 1)};
  const MaterialityCriterion criterion({});
  const auto training_shows_more = [&](const std::vector<Profile>& train, const std::vector<Profile>& held_out) {
    const Dataset data = prepare(blind::record(bench, train, 1), blind::record(bench, held_out, 9), bench.model);
    FittedTrials trials(data, bench.model, criterion, {}, 5);
    const Trial first = trials.first_fit(bench.model);
    EXPECT_TRUE(criterion.remainder(first.held_out)) << "it is not as if nothing showed";
    return trials.training_shows_more(first);
  };
  EXPECT_TRUE(training_shows_more(full, little));
  EXPECT_FALSE(training_shows_more(little, full));
}

TEST(Diagnose, NamesTheLimitOfASourceThatHoldsItsCurrent) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.current_limit = 2;  // [A]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("current_limit")) << report(d);
  EXPECT_NEAR(fitted(d, "i_max"), 2, 0.02);
  EXPECT_EQ(d.verdict, Verdict::found);
}

// What is fitted to the other has seen nothing of it: the run is judged on itself, as a single one would be.
TEST(Diagnose, FindsWhatASingleTrainingRunShows) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.rise = bench.plant.driver.fall = 60;  // V/s; the model's: 2000
  bench.train = {random_steps("steps", -3, 3, 0.3, 0.8, 0.5, 4, 1, 7), ramp("slow", 5, 2.5, 0.5, 1, 1)};
  bench.held_out = {ramp("unseen", -4, 2.5, 0.5, 1, 1)};
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("driver_slew")) << report(d);
  EXPECT_TRUE(d.training_judges);
}

TEST(Diagnose, FindsNothingInColouredNoiseOfTheTacho) {
  blind::Bench bench = blind::slow_bench();
  for (auto& channel : bench.channels) {
    if (channel.signal == Signal::omega) channel.correlation = 0.9;
  }
  const Diagnosis d = diagnose_on(bench);
  EXPECT_EQ(d.verdict, Verdict::nothing_missing) << report(d);
}

TEST(Diagnose, NamesTheFrictionOfThePaperAndBringsTheParametersBack) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.friction.T_c = 0.0547;  // [N m] the intercept of the paper's figure 6
  const Diagnosis d = diagnose_on(bench);
  EXPECT_EQ(d.verdict, Verdict::found) << report(d);
  EXPECT_THAT(named(d), ElementsAre("coulomb_friction"));
  EXPECT_GE(d.base_held_out, 2);
  EXPECT_LE(d.final_held_out, 1.1);
  EXPECT_NEAR(fitted(d, "T_c"), 0.0547, 0.03 * 0.0547);
  EXPECT_NEAR(d.final.values()[3], 1e-4, 0.1e-4) << "B";
  EXPECT_NEAR(d.final.values()[4], 3.449e-3, 0.03 * 3.449e-3) << "J";
}

Diagnosis diagnose_with(const DiagnoseOptions& options) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction.T_c = 0.003;  // [N m]
  return diagnose(record(bench, bench.train, 1), record(bench, bench.held_out, 101), bench.model, options);
}

TEST(Diagnose, IsCutWhereItsEffortIsUsedUpOrSomebodyEndsIt) {
  DiagnoseOptions hardly_any, ended;
  hardly_any.effort = 1e-9;
  ended.ends_now = [] { return true; };
  for (const DiagnoseOptions& options : {hardly_any, ended}) {
    const Diagnosis d = diagnose_with(options);
    EXPECT_TRUE(d.cut);
    EXPECT_EQ(d.verdict, Verdict::unknown_effect) << report(d);
    EXPECT_THAT(named(d), IsEmpty());
    EXPECT_NEAR(d.final_held_out, d.base_held_out, 0.01 * d.base_held_out);
  }
  EXPECT_FALSE(diagnose_with({}).cut);
}

TEST(Diagnose, CountsTheSameWorkOnOneThreadAsOnAll) {
  const std::uint64_t on_all = diagnose_with({}).data->effort->steps();
  const OneThreadHere alone;
  EXPECT_EQ(diagnose_with({}).data->effort->steps(), on_all);
  EXPECT_GT(on_all, 0U);
}

TEST(Diagnose, NamesDryFrictionOfEitherLawOnTheFastBench) {
  for (const auto law : {simulated::FrictionLaw::bristle, simulated::FrictionLaw::hard}) {
    blind::Bench bench = blind::fast_bench();
    bench.plant.friction = {.law = law, .T_c = 0.003};  // [N m]
    const Diagnosis d = diagnose_on(bench);
    EXPECT_THAT(named(d), ElementsAre("coulomb_friction")) << report(d);
    EXPECT_NEAR(fitted(d, "T_c"), 0.003, 1e-4);
  }
}

TEST(Diagnose, NamesWindage) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.motor.windage = 3e-6;  // [N m s2/rad2]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("windage")) << report(d);
  EXPECT_NEAR(fitted(d, "c_w"), 3e-6, 0.1e-6);
}

TEST(Diagnose, NamesAConstantLoadOnTheBenchThatTurnsBothWays) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.torque = 0.01;  // [N m] five times the gauge's noise
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::torque; });  // nothing measures it
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named_or_tied(d), Contains("load_torque")) << report(d);
  EXPECT_NEAR(fitted(d, "T_L"), 0.01, 5e-4);
}

TEST(Diagnose, CannotTellAConstantLoadFromFrictionInOneDirectionWithoutAGauge) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.friction.T_c = 0.04;  // [N m]
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::torque; });
  // Never at rest under way: only a standstill would tell them apart.
  bench.train = {staircase("up and down", std::vector<double>{2, 4, 6, 3, 5}, 0, 5, 0, 2),
                 ramp("ramp", 6, 0.6, 0, 3, 3, 1)};
  bench.held_out = {staircase("other", std::vector<double>{3, 6, 4, 2, 5}, 0, 5, 0, 3)};
  const Diagnosis d =
      diagnose(under_way(record(bench, bench.train, 1)), under_way(record(bench, bench.held_out, 9)), bench.model);
  EXPECT_THAT(named_or_tied(d), Contains("coulomb_friction")) << report(d);
  EXPECT_THAT(named_or_tied(d), Contains("load_torque")) << report(d);
  EXPECT_EQ(d.verdict, Verdict::tied) << report(d);
}

TEST(Diagnose, NamesCoggingThatIsNeverPassedSlowly) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.shaft.cogging = 0.008;  // [N m]
  bench.plant.shaft.cogging_order = 6;
  bench.plant.shaft.cogging_phase = 1;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("cogging")) << report(d);
  EXPECT_NEAR(fitted(d, "T_cog"), 0.008, 0.02 * 0.008);
  EXPECT_NEAR(fitted(d, "N"), 6, 0.01);
  EXPECT_LE(d.final_held_out, 1.12);
}

TEST(Diagnose, CallsWhatPullsOnceATurnALoadOffCentreAndNoCogging) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.eccentric = 0.004;  // [N m]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named_or_tied(d), ElementsAre("eccentric_load")) << report(d);
  EXPECT_NEAR(fitted(d, "T_e"), 0.004, 0.03 * 0.004);
}

TEST(Diagnose, NamesALoadOffCentreBehindALagOfTheTacho) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.load.eccentric = 0.05;      // [N m]
  bench.plant.sensors.tacho_lag = 25e-3;  // [s] 3.5 rad of the shaft at 140 rad/s
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("eccentric_load", "tacho_lag")) << report(d);
  EXPECT_NEAR(fitted(d, "T_e"), 0.05, 0.01 * 0.05);
  EXPECT_LE(d.final_held_out, 1.05);
}

Diagnosis diagnose_teeth(double torque, double second_harmonic) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.shaft.cogging = torque;
  bench.plant.shaft.cogging_order = 14;
  bench.plant.shaft.cogging_second = second_harmonic;
  return diagnose_on(bench);
}

TEST(Diagnose, NamesTeethThatOthersComeNearEnoughToBeTakenFirst) {
  const Diagnosis d = diagnose_teeth(0.12, 0.1);
  EXPECT_THAT(named(d), ElementsAre("cogging")) << report(d);
  EXPECT_EQ(d.verdict, Verdict::found);
  // `emtb add cogging` begins its fit where the diagnosis would: at the timing that the model without it tells.
  Dataset data = *d.data;
  CalibrationOptions one_start;
  one_start.extra_starts = 0;
  const Fit base = calibrate(data, d.base, one_start);
  const Fit begun = begun_refit_with(data.train, base, base.model, effect_index("cogging"));
  const Model added = calibrate(std::span<const Record>(data.train), begun.model, one_start).model;
  const double train = error_of(mean_squares(residuals(data.train, added, added.values(), {})));
  EXPECT_LT(train, 1.2 * d.final_train);  // 15 teeth in place of 14 come as near
}

TEST(Diagnose, NamesTeethAlsoWhereTheShaftStopsOnceAtAnotherThanTheModels) {
  const Diagnosis d = diagnose_teeth(0.15, 0);
  EXPECT_THAT(named(d), ElementsAre("cogging")) << report(d);
  EXPECT_NEAR(fitted(d, "T_cog"), 0.15, 0.002);
}

TEST(Diagnose, NamesTheInductanceWhereTheDriverIsFastEnoughToShowIt) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.motor.L_a = 2e-3;  // [H]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("armature_inductance")) << report(d);
  EXPECT_NEAR(fitted(d, "L_a"), 2e-3, 0.1e-3);
}

TEST(Diagnose, NamesTheDeadZoneOfTheDriver) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.driver.dead_zone = 0.1;  // [V]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("driver_dead_zone")) << report(d);
  EXPECT_NEAR(fitted(d, "u_d"), 0.1, 0.003);
}

TEST(Diagnose, NamesTheLagOfTheTacho) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.sensors.tacho_lag = 8e-3;  // [s]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("tacho_lag")) << report(d);
  EXPECT_NEAR(fitted(d, "tau"), 8e-3, 0.4e-3);
}

TEST(Diagnose, CallsADriverWithTwoPolesALagAndNoDelayToo) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.lag = 0.006;  // [s] two of half of it
  bench.plant.laws = simulated::Laws::other;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("driver_lag")) << report(d);
  EXPECT_NEAR(fitted(d, "tau"), 0.006, 1e-3);
}

TEST(Diagnose, NamesALagAndADelayWhereBothAreThere) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.lag = 0.004;    // [s]
  bench.plant.driver.delay = 0.003;  // [s]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), testing::UnorderedElementsAre("driver_lag", "driver_delay")) << report(d);
}

TEST(Diagnose, NamesALateGaugeBesideTheLoadThatItReads) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.eddy_torque = 0.03;  // [N m]
  bench.plant.load.eddy_omega = 200;    // [rad/s]
  EXPECT_THAT(named(diagnose_on(bench)), ElementsAre("eddy_brake")) << "a gauge in time";
  bench.plant.sensors.torque_lag = 0.03;  // [s]
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), testing::UnorderedElementsAre("eddy_brake", "torque_lag")) << report(d);
  EXPECT_NEAR(fitted(d, "tau"), 0.03, 3e-3);
  EXPECT_LE(d.final_held_out, 1.1);
}

TEST(Diagnose, NamesTwoEffectsThatAreBothThere) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction.T_c = 0.003;
  bench.plant.motor.L_a = 3e-3;
  const Diagnosis d = diagnose_on(bench);
  std::vector<std::string> ids = named(d);
  std::ranges::sort(ids);
  EXPECT_THAT(ids, ElementsAre("armature_inductance", "coulomb_friction")) << report(d);
  EXPECT_LE(d.final_held_out, 1.1);
}

TEST(Diagnose, SaysThatAnEffectIsUnknownRatherThanNameAWrongOne) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.hidden_torque = [](double omega, double, double) {  // a bump of friction at one speed
    return std::copysign(0.01 * std::exp(-std::pow((std::abs(omega) - 250) / 40, 2)), omega);
  };
  const Diagnosis d = diagnose_on(bench);
  EXPECT_EQ(d.verdict, Verdict::unknown_effect) << report(d);
}

TEST(Diagnose, CannotTellFromAMotorThatNeverTurned) {
  blind::Bench bench = blind::slow_bench();
  bench.train = {step("rest", 0, 2, 2, 2), step("rest too", 0, 2, 2, 2)};
  bench.held_out = {step("still at rest", 0, 2, 2, 2)};
  const Diagnosis d = diagnose_on(bench);
  EXPECT_EQ(d.verdict, Verdict::cannot_tell) << report(d);
}

TEST(Diagnose, HoldsEachRunOutInTurnWhereNoneIsNamed) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.friction.T_c = 0.0547;
  const Diagnosis d = diagnose(record(bench, bench.train, 1), {}, bench.model);
  EXPECT_TRUE(d.left_one_out);
  EXPECT_THAT(named(d), ElementsAre("coulomb_friction")) << report(d);
}

}  // namespace
}  // namespace emtb
