#include "analysis/diagnose/bench_parts.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

#include "analysis/diagnose/moves.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "tests/analysis/diagnose/answers.h"
#include "tests/analysis/synthetic.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using namespace answers;
using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

/// The effects that a search would not try on the runs of a bench, with the reasons.
std::map<std::string, std::string> withheld_on(const std::vector<Run>& runs, const Model& model) {
  std::map<std::string, std::string> why;
  const Dataset data = prepare(runs, {}, model);
  for (const Withheld& w : withheld_effects(model, data.train)) why[std::string(model.about(w.effect).id)] = w.why;
  return why;
}

std::vector<std::string> tried_by(const Model& model) {
  std::vector<std::string> ids;
  for (const std::size_t effect : absent_effects(model)) ids.emplace_back(model.about(effect).id);
  return ids;
}

const std::vector<Run>& runs_of_the_servo() {
  static const std::vector<Run> runs{record(blind::fast_bench(), blind::fast_bench().train[0], 1)};
  return runs;
}

std::vector<Run> without(Signal signal, std::vector<Run> runs) {
  for (Run& run : runs) run.signals.erase(signal);
  return runs;
}

/// An encoder's angle in place of the tachogenerator's reading.
std::vector<Run> with_an_encoder(std::vector<Run> runs) {
  for (Run& run : runs) {
    Series theta = run.at(Signal::omega);
    double angle = 0;
    for (std::size_t k = 1; k < theta.t.size(); ++k) {
      angle += run.at(Signal::omega).value[k] * (theta.t[k] - theta.t[k - 1]);
      theta.value.edit()[k] = angle;
    }
    run.signals.erase(Signal::omega);
    run.signals[Signal::theta] = theta;
  }
  return runs;
}

TEST(BenchParts, NothingIsWithheldWhereAllIsMeasured) {
  EXPECT_THAT(withheld_on(runs_of_the_servo(), blind::fast_bench().model), testing::IsEmpty());
}

TEST(BenchParts, NoEffectOfATachogeneratorWhereAnEncoderGivesTheSpeed) {
  const auto why = withheld_on(with_an_encoder(runs_of_the_servo()), blind::fast_bench().model);
  for (const std::string id : {"tacho_lag", "tacho_offset", "tacho_ripple"}) {
    ASSERT_TRUE(why.contains(id)) << id;
    EXPECT_THAT(why.at(id), HasSubstr("no tachogenerator"));
  }
  EXPECT_FALSE(why.contains("coulomb_friction"));
}

TEST(BenchParts, NoEffectOfATachogeneratorWhereTheModelSaysThatTheSpeedIsAnEncoders) {
  Model model = blind::fast_bench().model;
  model.bench.tachogenerator = false;
  EXPECT_TRUE(withheld_on(runs_of_the_servo(), model).contains("tacho_lag"));
}

TEST(BenchParts, NoEffectOfAGaugeWithoutOne) {
  const auto why = withheld_on(without(Signal::torque, runs_of_the_servo()), blind::fast_bench().model);
  for (const std::string id : {"torque_lag", "torque_offset", "dry_brake"}) EXPECT_TRUE(why.contains(id)) << id;
  EXPECT_FALSE(why.contains("load_torque")) << "shows in the speed, too";
}

TEST(BenchParts, NoWaveOfATurnWhereRowsAreFartherApartThanHalfATurn) {
  const Model model = blind::fast_bench().model;
  for (const double turns : {0.02, 3.0}) {  // from row to row
    const double interval = 2 * std::numbers::pi * turns / 100;
    emtb::Run run;
    run.name = "steady";
    run.signals[Signal::u_ref] = synthetic::series(interval, 300 * interval, [](double) { return 2.0; });
    run.signals[Signal::omega] = synthetic::series(interval, 300 * interval, [](double) { return 100.0; });
    const auto why = withheld_on({run}, model);
    for (const std::string id : {"cogging", "eccentric_load", "tacho_ripple"})
      EXPECT_EQ(why.contains(id), turns > 0.5) << id << " at " << turns;
  }
}

TEST(BenchParts, NoOffsetOfACurrentThatIsNotRead) {
  EXPECT_TRUE(
      withheld_on(without(Signal::i_a, runs_of_the_servo()), blind::fast_bench().model).contains("current_offset"));
}

TEST(BenchParts, ACurrentDriveHasNoArmatureCircuitNoDriverAndNoFieldThatIsKnown) {
  Model model = blind::fast_bench().model;
  model.input = Signal::i_a;
  for (const std::size_t circuit : {0U, 1U}) model.base[circuit].fixed = true;
  const auto why = withheld_on(runs_of_the_servo(), model);
  for (const std::string id : {"driver_lag", "driver_delay", "armature_inductance", "brush_drop", "armature_heating",
                               "field_heating", "current_offset"}) {
    EXPECT_TRUE(why.contains(id)) << id;
  }
  EXPECT_FALSE(why.contains("armature_reaction")) << "bends the torque that a current makes";
  model.bench.field_winding = true;
  EXPECT_FALSE(withheld_on(runs_of_the_servo(), model).contains("field_heating"));
}

TEST(BenchParts, AMotorWithMagnetsHasNoFieldToHeat) {
  Model model = blind::fast_bench().model;
  model.bench.field_winding = false;
  EXPECT_TRUE(withheld_on(runs_of_the_servo(), model).contains("field_heating"));
}

TEST(BenchParts, APersonMayAskForSomeEffectsOnly) {
  Model model = blind::fast_bench().model;
  withhold_unwanted(model, {.only = {"windage,stribeck_friction"}});
  EXPECT_THAT(tried_by(model), ElementsAre("coulomb_friction", "stribeck_friction", "windage"))
      << "with what one of them needs";
}

TEST(BenchParts, APersonMayLeaveEffectsOut) {
  Model model = blind::fast_bench().model;
  withhold_unwanted(model, {.without = {"cogging", "windage,brush_drop"}});
  EXPECT_EQ(tried_by(model).size(), effect_count - 3);
  EXPECT_THAT(tried_by(model), Not(Contains("windage")));
  const auto why = withheld_on(runs_of_the_servo(), model);
  EXPECT_EQ(why.at("cogging"), "left out on request");
  EXPECT_THAT(absent_waves(model), ElementsAre(effect_index("tacho_ripple")));
}

TEST(BenchParts, AnUnknownEffectIsRefused) {
  Model model = blind::fast_bench().model;
  EXPECT_THROW(withhold_unwanted(model, {.without = {"coging"}}), ModelError);
}

TEST(BenchParts, ADiagnosisNamesNothingThatIsLeftOut) {
  blind::Bench bench = blind::slow_bench();
  bench.plant.friction.T_c = 0.0547;
  withhold_unwanted(bench.model, {.only = {"windage", "tacho_offset"}});
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named_or_tied(d), testing::IsSubsetOf({"windage", "tacho_offset"})) << report(d);
  EXPECT_EQ(d.candidates.size(), 2U);
  EXPECT_THAT(d.withheld, Contains(testing::Field(&Withheld::effect, effect_index("coulomb_friction"))));
}

}  // namespace
}  // namespace emtb
