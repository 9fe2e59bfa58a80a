#include "model/catalogue.h"

#include <gmock/gmock.h>

#include <map>
#include <set>
#include <string>

#include "hal/error.h"
#include "model/model.h"
#include "tests/model/benches.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;

/// The ids and parameters of the contract. Files, commands and checks rely on them.
const std::map<std::string_view, std::set<std::string_view>> contract{
    {"driver_gain_error", {"k", "e_0"}},
    {"driver_slew", {"rise", "fall"}},
    {"driver_dead_zone", {"u_d"}},
    {"driver_saturation", {"e_max"}},
    {"driver_output_resistance", {"R_o"}},
    {"driver_lag", {"tau"}},
    {"driver_delay", {"t_d"}},
    {"current_limit", {"i_max"}},
    {"one_quadrant_driver", {}},
    {"coasting_driver", {}},
    {"discontinuous_conduction", {"V_d", "i_c"}},
    {"pwm_drive", {"r", "V_s", "k"}},
    {"armature_inductance", {"L_a"}},
    {"brush_drop", {"V_b", "i_lin"}},  // the knee is ours
    {"armature_heating", {"C_th", "R_th"}},
    {"armature_reaction", {"k_i", "i_k"}},
    {"field_heating", {"drop", "tau"}},
    {"coulomb_friction", {"T_c"}},
    {"stribeck_friction", {"T_s", "omega_s"}},
    {"asymmetric_friction", {"T_d", "B_d"}},
    {"windage", {"c_w"}},
    {"load_dependent_friction", {"k_l"}},
    {"bearing_drag", {"c_b"}},
    {"presliding_friction", {"sigma_0"}},
    {"speed_delay", {"t_d"}},
    {"friction_warmup", {"drop", "tau"}},
    {"cogging", {"T_cog", "N", "phase"}},
    {"shaft_compliance", {"k", "d", "J_2"}},
    {"backlash", {"gap"}},
    {"load_torque", {"T_L"}},
    {"dry_brake", {"T_b"}},
    {"eccentric_load", {"T_e", "phase"}},
    {"spring_load", {"k", "T_0"}},
    {"eddy_brake", {"T_b", "omega_b"}},
    {"tacho_lag", {"tau"}},
    {"tacho_ripple", {"r", "N", "phase"}},
    {"tacho_offset", {"omega_0"}},
    {"torque_lag", {"tau"}},
    {"torque_offset", {"T_0"}},
    {"current_offset", {"i_0"}},
    {"supply_current", {"V_s"}}};

TEST(Catalogue, BoundsHoldTheSizesOfAWatchAndOfASlowLinearAxis) {
  Ranges watch, axis;
  watch.reference = watch.voltage = 1.5, watch.current = 1e-3, watch.torque = 1e-7, watch.speed = 2000;
  axis.reference = axis.voltage = 400, axis.current = 50, axis.torque = 5e4, axis.speed = 0.02;  // N and m/s
  for (const Ranges& machine : {watch, axis}) {
    for (const std::size_t effect : watched_effects()) {
      const EffectParameter& size = effect_catalogue()[effect].parameter_list.front();
      if (!size.unit.starts_with("N m")) continue;
      const double half = size_at(effect, 0.5, machine);
      EXPECT_LT(half, size.max) << effect_catalogue()[effect].id;
      EXPECT_GT(half, size.min) << effect_catalogue()[effect].id;
    }
  }
}

TEST(Catalogue, HoldsOnlyEffectsOfTheContractWithTheirParameters) {
  std::set<std::string_view> seen;
  for (const EffectInfo& effect : effect_catalogue()) {
    SCOPED_TRACE(effect.id);
    EXPECT_TRUE(seen.insert(effect.id).second) << "twice";
    ASSERT_TRUE(contract.contains(effect.id));
    std::set<std::string_view> symbols;
    for (const EffectParameter& p : effect.parameters()) EXPECT_TRUE(symbols.insert(p.symbol).second) << p.symbol;
    EXPECT_EQ(symbols, contract.at(effect.id));
  }
}

TEST(Catalogue, TellsOfEveryEffectWhatAPersonNeedsToKnow) {
  for (const EffectInfo& effect : effect_catalogue()) {
    SCOPED_TRACE(effect.id);
    for (const std::string_view text : {effect.name, effect.equation, effect.what, effect.shows, effect.told_apart,
                                        effect.source, name_of(effect.stage)}) {
      EXPECT_GT(text.size(), 3U);
    }
    for (const std::string_view sentence : {effect.what, effect.shows, effect.told_apart})
      EXPECT_TRUE(sentence.ends_with('.'));
  }
}

TEST(Catalogue, EveryNullLiesWithinItsBounds) {
  for (const EffectInfo& effect : effect_catalogue()) {
    for (const EffectParameter& p : effect.parameters()) {
      SCOPED_TRACE(std::string(effect.id) + "." + std::string(p.symbol));
      EXPECT_FALSE(p.unit.empty());
      EXPECT_LT(p.min, p.max);
      EXPECT_GE(p.null, p.min);
      EXPECT_TRUE(p.null <= p.max || p.null == infinity);
    }
    if (effect.opposes_motion) {
      EXPECT_GE(effect.parameters()[0].min, 0) << effect.id << " could push";
    }
  }
}

TEST(Catalogue, EveryTypicalSizeLiesWithinItsBoundsAndIsNotNull) {
  for (const EffectInfo& effect : effect_catalogue()) {
    for (const EffectParameter& p : effect.parameters()) {
      SCOPED_TRACE(std::string(effect.id) + "." + std::string(p.symbol));
      EXPECT_GT(p.typical, 0);
      EXPECT_GE(p.typical, p.min);
      EXPECT_LE(p.typical, p.max);
      if (!p.is_shape()) {
        EXPECT_NE(p.typical, p.null);
      }
    }
  }
}

TEST(Catalogue, TheRolesOfAnEffectsParametersGoTogether) {
  for (const EffectInfo& effect : effect_catalogue()) {
    SCOPED_TRACE(effect.id);
    const auto count = [&](Role role) { return std::ranges::count(effect.parameters(), role, &EffectParameter::role); };
    EXPECT_LE(count(Role::order), 1);
    EXPECT_EQ(count(Role::phase), effect.periodic ? 1 : 0) << "a wave has a phase, and nothing else has";
    if (count(Role::order) > 0) {
      EXPECT_TRUE(effect.periodic);
    }
    const bool all_shapes = std::ranges::all_of(effect.parameters(), &EffectParameter::is_shape);
    EXPECT_TRUE(all_shapes || !effect.parameters()[0].is_shape()) << "the amplitude comes first";
    EXPECT_TRUE(!all_shapes || effect.fades()) << "without an amplitude it is there or not";
    if (effect.periodic) {
      EXPECT_EQ(count(Role::amplitude), 1);
    }
    for (const EffectParameter& p : effect.parameters()) {
      if (p.role == Role::order) {
        EXPECT_EQ(p.unit, "1/turn");
      }
      if (p.role == Role::phase) {
        EXPECT_EQ(p.unit, "rad");
      }
    }
    EXPECT_TRUE(effect.needs.empty() || effect_index(effect.needs) < effect_count);
    EXPECT_TRUE(!effect.reads || effect.stage == Stage::sensors);
  }
}

/// What the paper's bench does in a run of some seconds.
constexpr Ranges seen{.reference = 6,
                      .voltage = 110,
                      .supply = 110,
                      .current = 3,
                      .torque = 2,
                      .speed = 150,
                      .duration = 20,
                      .sample = 0.001,
                      .logging = 0.00125,
                      .logged_lag = 0.00125,
                      .heat = 200,
                      .inertia = 3.4e-3,
                      .response = 0.2,
                      .twist = 0.04,
                      .rise = 22.5,
                      .fall = 20.4,
                      .ringing = 60};

TEST(Catalogue, EverySearchStartsWithinTheBounds) {
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    const EffectInfo& about = effect_catalogue()[effect];
    SCOPED_TRACE(about.id);
    const std::vector<StartValues> starts = starts_of(effect, seen);
    ASSERT_FALSE(starts.empty());
    for (const StartValues& start : starts) {
      for (std::size_t i = 0; i < about.parameter_count; ++i) {
        const EffectParameter& p = about.parameter_list[i];
        EXPECT_GE(start[i], p.min) << p.symbol;
        EXPECT_LE(start[i], p.max) << p.symbol;
      }
    }
  }
}

TEST(Catalogue, APlayIsTriedOnTheScaleOfTheTwistThatHidesIt) {
  Ranges axis = seen;
  axis.twist = 5e-4;  // [m] of a linear axis, whose angles are lengths
  const std::vector<StartValues> starts = starts_of(effect_index("backlash"), axis);
  EXPECT_LT(starts.front()[0], 0.1 * axis.twist);
  EXPECT_GT(starts.back()[0], axis.twist);
  EXPECT_LT(starts.back()[0], 10 * axis.twist);
}

TEST(Catalogue, SlopesOfADriverOfWhichNothingIsKnownAreTriedFromARowToAFifthOfARun) {
  Ranges unknown = seen;
  unknown.rise = unknown.fall = DriverModel::unlimited;
  unknown.duration = 1000 * unknown.sample;
  const std::vector<StartValues> starts = starts_of(effect_index("driver_slew"), unknown);
  EXPECT_EQ(starts.front()[0], DriverModel::unlimited);
  EXPECT_NEAR(unknown.voltage / starts[1][0], 1.5 * unknown.sample, 1e-9);
  EXPECT_NEAR(unknown.voltage / starts.back()[0], 200 * unknown.sample, 1e-6);
}

TEST(Catalogue, ASpringIsTriedFromAboveTheResponseToEightRowsAPeriod) {
  double quickest = 0;  // [rad/s]
  for (const StartValues& start : starts_of(effect_index("shaft_compliance"), seen)) {
    const double k = start[0], J_2 = start[2];
    quickest = std::max(quickest, std::sqrt(k / J_2 * seen.inertia / (seen.inertia - J_2)));
  }
  EXPECT_NEAR(quickest * seen.sample, std::max(0.8, 9 * seen.sample / seen.response), 1e-6);
}

TEST(Catalogue, KnowsWhatIsThereOrNotWithoutASize) {
  for (const char* id : {"coasting_driver", "one_quadrant_driver", "supply_current"}) {
    EXPECT_TRUE(effect_catalogue()[effect_index(id)].has_no_size()) << id;
  }
  EXPECT_FALSE(effect_catalogue()[effect_index("pwm_drive")].has_no_size()) << "a period and a decay";
  EXPECT_FALSE(effect_catalogue()[effect_index("coulomb_friction")].has_no_size());
}

TEST(Catalogue, LagsAndDelaysAreTriedFromARowToBeyondTheResponse) {
  const std::vector<double> times = seen.edge_times();
  EXPECT_EQ(times.front(), 0);
  EXPECT_DOUBLE_EQ(times[1], seen.logging);
  EXPECT_DOUBLE_EQ(times.back(), 3 * seen.response);
  Ranges brief = seen;
  brief.duration = 0.5;
  EXPECT_DOUBLE_EQ(brief.edge_times().back(), 0.1) << "what lasts longer no run tells";
}

TEST(Catalogue, WhatIsTriedAtSizesBesideItsNullStartsThere) {
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    const EffectInfo& about = effect_catalogue()[effect];
    if (about.at_null != AtNull::small) continue;
    SCOPED_TRACE(about.id);
    const std::vector<StartValues> starts = starts_of(effect, seen);
    ASSERT_GT(starts.size(), 1U);
    const bool limit = about.parameter_list[0].role == Role::limit;
    EXPECT_EQ(starts.front()[0], limit ? seen.rise : about.parameter_list[0].null);
  }
}

/// The machine of a test bench, and about how far it goes there.
FittedMachine machine_of(const testing_benches::TestBench& bench) {
  FittedMachine machine{.R_a = bench.base[base::R_a],
                        .K_b = bench.base[base::K_b],
                        .K_m = bench.base[base::K_m],
                        .B = bench.base[base::B],
                        .J = bench.base[base::J],
                        .current_driven = false,
                        .seen = {}};
  const bool slow = bench.name == "slow";
  machine.seen.reference = 6;
  machine.seen.voltage = machine.seen.supply = slow ? 110 : 24;
  machine.seen.current = slow ? 0.5 : 20;
  machine.seen.speed = machine.seen.voltage / machine.K_b;
  machine.seen.duration = 10;
  machine.seen.heat = slow ? 10 : 100;
  machine.seen.inertia = machine.J;
  return machine;
}

TEST(Catalogue, EveryTypicalSizeIsPlausibleOnItsBench) {
  for (const auto& bench : {testing_benches::slow_bench(), testing_benches::fast_bench()}) {
    for (std::size_t effect = 0; effect < effect_count; ++effect) {
      std::vector<double> values;
      for (std::size_t i = 0; i < effect_catalogue()[effect].parameter_count; ++i) {
        values.push_back(bench.typical.at(full_name(effect_catalogue()[effect], i)));
      }
      EXPECT_EQ(implausible(effect, values, machine_of(bench)), "")
          << effect_catalogue()[effect].id << " " << bench.name;
    }
  }
}

TEST(Catalogue, EveryEffectWithASizeKnowsOneThatItCannotHave) {
  const FittedMachine machine = machine_of(testing_benches::fast_bench());
  for (std::size_t effect = 0; effect < effect_count; ++effect) {
    const EffectInfo& about = effect_catalogue()[effect];
    const bool limit = about.clips || (about.parameter_count > 0 && about.parameter_list[0].role == Role::limit);
    if (limit || about.parameter_count == 0) continue;
    std::vector<double> largest;
    for (const EffectParameter& p : about.parameters()) largest.push_back(p.null == infinity ? p.min : p.max);
    std::vector<double> smallest;
    for (const EffectParameter& p : about.parameters()) smallest.push_back(p.min);
    EXPECT_NE(implausible(effect, largest, machine) + implausible(effect, smallest, machine), "") << about.id;
  }
}

TEST(Catalogue, PlausibilityOfTorquesDoesNotHangOnTheirScale) {
  FittedMachine machine = machine_of(testing_benches::fast_bench());
  const std::size_t friction = effect_index("coulomb_friction");
  const double stall = machine.stall_torque();
  EXPECT_EQ(implausible(friction, std::vector{0.9 * stall}, machine), "");
  EXPECT_NE(implausible(friction, std::vector{1.1 * stall}, machine), "");
  for (double* scaled : {&machine.K_m, &machine.B, &machine.J}) *scaled *= 1000;
  EXPECT_EQ(implausible(friction, std::vector{900 * stall}, machine), "");
  EXPECT_NE(implausible(friction, std::vector{1100 * stall}, machine), "");
}

TEST(Catalogue, APlayBehindAGearMayBeMostOfATurn) {
  const FittedMachine machine = machine_of(testing_benches::fast_bench());
  const std::size_t play = effect_index("backlash");
  EXPECT_EQ(implausible(play, std::vector{3.5}, machine), "");  // two degrees behind a gear of 100
  EXPECT_NE(implausible(play, std::vector{6.5}, machine), "");
}

TEST(Catalogue, AWeightOffCentreTurnsOnceOrHangsAtOneAngle) {
  FittedMachine machine = machine_of(testing_benches::fast_bench());
  const std::size_t weight = effect_index("eccentric_load");
  const std::vector<double> little{0.01 * machine.stall_torque(), 0};
  for (const double turns : {0.2, 5.0}) {
    for (const bool parts_of_a_turn_tell : {false, true}) {
      machine.turns = turns;
      machine.parts_of_a_turn_tell = parts_of_a_turn_tell;
      EXPECT_EQ(implausible(weight, little, machine).empty(), turns > 1 || parts_of_a_turn_tell)
          << turns << ' ' << parts_of_a_turn_tell;
    }
  }
}

TEST(Catalogue, ASpringIsNotWoundUpByMoreThanSomeTurns) {
  FittedMachine machine = machine_of(testing_benches::fast_bench());
  const std::size_t spring = effect_index("spring_load");
  const double stall = machine.stall_torque();
  machine.turns = 5;
  EXPECT_EQ(implausible(spring, std::vector{0.01 * stall, 0.5 * stall}, machine), "");
  EXPECT_NE(implausible(spring, std::vector{0.01 * stall, 6 * stall}, machine), "");
  machine.turns = 50;
  EXPECT_NE(implausible(spring, std::vector{1e-4 * stall, 0.5 * stall}, machine), "");
  EXPECT_EQ(implausible(spring, std::vector{5e-3 * stall, 0.5 * stall}, machine), "") << "behind a gear";
}

TEST(Catalogue, KnowsWhichTorqueAShaftRestsIn) {
  EXPECT_TRUE(effect_catalogue()[effect_index("cogging")].is_detent());
  EXPECT_FALSE(effect_catalogue()[effect_index("eccentric_load")].is_detent()) << "once a turn";
  EXPECT_FALSE(effect_catalogue()[effect_index("tacho_ripple")].is_detent()) << "no torque";
  EXPECT_TRUE(effect_catalogue()[effect_index("tacho_ripple")].is_wave());
  EXPECT_FALSE(effect_catalogue()[effect_index("eccentric_load")].is_wave()) << "once a turn";
}

TEST(Catalogue, IsWatchedForWhatHasASizeAndNoShapeThatMatters) {
  const std::vector<std::size_t> watched = watched_effects();
  ASSERT_FALSE(watched.empty());
  std::set<int> ranks;
  for (const std::size_t effect : watched) {
    const EffectInfo& about = effect_catalogue()[effect];
    SCOPED_TRACE(about.id);
    EXPECT_TRUE(ranks.insert(about.watch->rank).second) << "which comes first?";
    EXPECT_FALSE(about.periodic || about.fades() || about.at_null != AtNull::all);
    const double size = size_at(effect, 0.02, seen);
    EXPECT_GT(size, about.parameter_list[0].null);
    EXPECT_LE(size, about.parameter_list[0].max);
  }
}

TEST(Catalogue, SaysWhatAnEffectNeeds) {
  const auto needs = [](std::string_view id) { return needs_of(effect_catalogue()[effect_index(id)]); };
  EXPECT_EQ(needs("windage"), "");
  EXPECT_EQ(needs("stribeck_friction"), "coulomb_friction");
  EXPECT_EQ(needs("dry_brake"), "a torque gauge");
  EXPECT_EQ(needs("field_heating"), "a field winding");
  for (const EffectInfo& effect : effect_catalogue()) {
    SCOPED_TRACE(effect.id);
    EXPECT_EQ(effect.bench.driver, effect.stage == Stage::driver);
    if (effect.reads == Signal::torque) {
      EXPECT_TRUE(effect.bench.torque_gauge);
    }
  }
}

TEST(Catalogue, EffectsOfOneFamilyActInOneStage) {
  for (const EffectInfo& a : effect_catalogue()) {
    for (const EffectInfo& b : effect_catalogue()) {
      if (a.same_family(b)) {
        EXPECT_EQ(a.stage, b.stage) << a.id << " " << b.id;
      }
    }
  }
  EXPECT_TRUE(
      effect_catalogue()[effect_index("driver_lag")].same_family(effect_catalogue()[effect_index("driver_delay")]));
}

TEST(Catalogue, FindsEveryEffectByItsId) {
  for (std::size_t i = 0; i < effect_count; ++i) EXPECT_EQ(effect_index(effect_catalogue()[i].id), i);
}

std::string complaint_about(const std::string& id) {
  try {
    effect_index(id);
  } catch (const ModelError& e) {
    return e.what();
  }
  return "`" + id + "` was accepted";
}

TEST(Catalogue, NamesTheIdThatWasMeantWhereOneIsUnknown) {
  EXPECT_EQ(complaint_about("coulomb"), "unknown effect `coulomb`; did you mean coulomb_friction?");
  EXPECT_EQ(complaint_about("tacho_leg"), "unknown effect `tacho_leg`; did you mean tacho_lag?");
}

TEST(Catalogue, NamesTheKnownIdsWhereNoneIsNear) {
  EXPECT_THAT(complaint_about("gremlins"), AllOf(HasSubstr("unknown effect `gremlins`. Known: driver_gain_error, "),
                                                 HasSubstr("coulomb_friction"), HasSubstr("tacho_lag")));
}

TEST(Catalogue, AFormulaMayBeWhatWasMeant) {
  Model model;
  model.offered.push_back({});
  model.offered.back().name = "rope_drag";
  EXPECT_EQ(model.effect_named("rope_drag"), effect_count);
  EXPECT_EQ(model.effect_named("cogging"), effect_index("cogging"));
  try {
    model.effect_named("rope_drug");
    FAIL() << "`rope_drug` was accepted";
  } catch (const ModelError& e) {
    EXPECT_STREQ(e.what(), "unknown effect `rope_drug`; did you mean rope_drag?");
  }
}

TEST(Catalogue, StandsInTheOrderOfTheStages) {
  EXPECT_TRUE(std::ranges::is_sorted(effect_catalogue(), {}, &EffectInfo::stage));
}

}  // namespace
}  // namespace emtb
