#include "analysis/fit/gauge.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>

#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "model/catalogue.h"
#include "tests/analysis/synthetic.h"

namespace emtb::gauge_tests {
namespace {

using synthetic::record;
using synthetic::servo_model;
using synthetic::Truth;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr synthetic::Sigma quiet{.omega = 0.1, .i_a = 0.01, .e_a = 0.02};

Model with_noise(Model model) {
  model.noise = {{Signal::omega, quiet.omega}, {Signal::i_a, quiet.i_a}, {Signal::e_a, quiet.e_a}};
  return model;
}

std::vector<Record> prepared(const std::vector<emtb::Run>& runs, const Model& model) {
  return prepare(runs, {}, model).train;
}

std::vector<emtb::Run> with_current() { return {record({}, synthetic::steps, 1e-3, quiet)}; }

std::vector<emtb::Run> speed_only() {
  std::vector<emtb::Run> runs = with_current();
  runs[0].signals.erase(Signal::i_a);
  runs[0].signals.erase(Signal::e_a);
  return runs;
}

/// A shaft that comes to rest by itself with the armature open: J domega/dt = -B omega - T_c.
std::vector<emtb::Run> coast_down(const Truth& p, double T_c, double from = 200 /* rad/s */) {
  emtb::Run run;
  run.name = "coast";
  const auto speed = [&](double t) { return std::max(0.0, (from + T_c / p.B) * std::exp(-p.B / p.J * t) - T_c / p.B); };
  synthetic::Noise noise(3);
  constexpr double interval = 5e-3, seconds = 12;
  run.signals[Signal::u_ref] = synthetic::series(interval, seconds, [](double) { return 0; });
  run.signals[Signal::armature_open] = synthetic::series(interval, seconds, [](double) { return 1; });
  run.signals[Signal::omega] =
      synthetic::series(interval, seconds, [&](double t) { return speed(t) + noise(quiet.omega); });
  return {run};
}

std::vector<std::string> held_for(const std::vector<emtb::Run>& runs, const Model& model) {
  const auto records = prepared(runs, model);
  const Model fitted = calibrate(records, model).model;
  std::vector<std::string> names;
  for (const std::size_t place : places_to_hold(records, fitted)) names.push_back(model.names()[place]);
  return names;
}

TEST(Gauge, NothingIsHeldWhereTheCurrentIsMeasured) {
  EXPECT_THAT(held_for(with_current(), with_noise(servo_model())), IsEmpty());
}

TEST(Gauge, SpeedAndVoltageLeaveTheSizeOfRaAndBBesideKbOpen) {
  EXPECT_THAT(held_for(speed_only(), with_noise(servo_model())), ElementsAre("B", "R_a"));
}

TEST(Gauge, WhatTheUserFixedOrKnowsBreaksTheDirection) {
  Model fixed = with_noise(servo_model());
  fixed.base[base::R_a].fixed = true;
  EXPECT_THAT(held_for(speed_only(), fixed), ElementsAre("B"));
  Model known = with_noise(servo_model());
  known.base[base::J].prior = Prior{5e-5, 1e-5};
  EXPECT_THAT(held_for(speed_only(), known), ElementsAre("B"));
  Model guessed = with_noise(servo_model());
  guessed.base[base::J].prior = Prior{5e-5, 5e-3};
  EXPECT_THAT(held_for(speed_only(), guessed), ElementsAre("B", "R_a")) << "a prior of a factor of 100 tells nothing";
}

TEST(Gauge, CarriesAlongWhatOnlyTheOthersLeaveOpen) {
  Model model = with_noise(servo_model());
  model.base[base::B].fixed = true;
  const auto carried = [&](const std::vector<emtb::Run>& runs, std::size_t place) {
    const std::vector<Record> records = prepared(runs, model);
    return carried_along(records, calibrate(records, model).model, place);
  };
  EXPECT_TRUE(carried(speed_only(), base::J)) << "with R_a";
  EXPECT_FALSE(carried(speed_only(), base::K_b));
  EXPECT_FALSE(carried(with_current(), base::J));
}

TEST(Gauge, KmIsHeldBeforeJWhereItIsNotTied) {
  Model model = with_noise(servo_model());
  model.tie.clear();
  EXPECT_THAT(held_for(speed_only(), model), ElementsAre("B", "R_a", "K_m"));
}

TEST(Gauge, ACoastDownTellsRatiosToJAlone) {
  const Truth truth;
  constexpr double T_c = 0.0012;  // [N m]
  Model model = with_noise(servo_model());
  const auto records = prepared(coast_down(truth, T_c), model);
  const Model fitted = calibrate(records, model).model;
  const std::vector<std::size_t> places = places_to_hold(records, fitted);
  EXPECT_NE(std::ranges::find(places, base::J), places.end());
  EXPECT_EQ(std::ranges::find(places, base::B), places.end()) << "B goes as J";
  for (const double factor : {1.0, 3.0}) {
    Model given = model;
    given.base[base::J].value *= factor;
    Model held = hold(records, given, fitted, places);
    EXPECT_EQ(held.base[base::J].value, given.base[base::J].value);
    const std::size_t friction = effect_index("coulomb_friction");
    held.include(friction);
    held.parameters_of(friction)[0].value = 0.001;
    const Calibration c = calibrate(records, held);
    const Parameter& found = c.model.parameters_of(friction)[0];
    const double J = c.model.base[base::J].value;
    ASSERT_TRUE(found.std_error);
    EXPECT_NEAR(found.value / J, T_c / truth.J, 3 * *found.std_error / J);
    // The speed that a run starts with is a reading: half a thousandth of it counts beside what the fit knows of.
    EXPECT_NEAR(c.model.base[base::B].value / J, truth.B / truth.J,
                3 * *c.model.base[base::B].std_error / J + 0.005 * truth.B / truth.J);
    const std::vector<Pin> pins = pins_of(records, c.model);
    EXPECT_THAT(scaled_with(pins, "coulomb_friction.T_c"), ElementsAre("J"));
    EXPECT_THAT(scaled_with(pins, "B"), ElementsAre("J"));
  }
}

TEST(Gauge, APinLosesNothingAndLeavesTheOthersInsideTheirBounds) {
  Model model = with_noise(servo_model());
  model.base[base::R_a].max = 100;
  model.base[base::R_a].value = 60;  // for which J would have to be 1.2e-6, below its bound
  const auto records = prepared(speed_only(), model);
  const Calibration free = calibrate(records, model);
  const std::vector<std::size_t> places{base::B, base::R_a};
  const Model held = hold(records, model, free.model, places);
  EXPECT_TRUE(held.base[base::R_a].pinned);
  EXPECT_LT(held.base[base::R_a].value, 60);
  const Calibration fitted = calibrate(records, held);
  EXPECT_LT(fitted.cost, 1.01 * free.cost);
  EXPECT_GT(fitted.model.base[base::J].value, 1.5 * model.base[base::J].min);
  EXPECT_THAT(fitted.identifiability.undetermined, IsEmpty());
}

TEST(Gauge, WhatGoesWithAPinIsToldWithItsPower) {
  const Model model = with_noise(servo_model());
  const auto records = prepared(speed_only(), model);
  const Model held =
      hold(records, model, calibrate(records, model).model, std::vector<std::size_t>{base::B, base::R_a});
  const std::vector<Pin> pins = pins_of(records, calibrate(records, held).model);
  ASSERT_EQ(pins.size(), 2U);
  EXPECT_EQ(pins[0].parameter, "R_a");
  EXPECT_FALSE(pins[0].current_read);
  ASSERT_EQ(pins[0].followers.size(), 1U);
  EXPECT_EQ(pins[0].followers[0].parameter, "J");
  EXPECT_NEAR(pins[0].followers[0].power, -1, 0.02) << "J R_a is told";
  EXPECT_EQ(pins[1].parameter, "B");
}

TEST(Gauge, AConstantIsKnownNoBetterThanTheDampingThatIsHeldBesideIt) {
  constexpr double half = 0.5, three_times = 3, z = 1.96;
  Model given = with_noise(servo_model());
  const auto records = prepared(speed_only(), given);
  const Model held =
      hold(records, given, calibrate(records, given).model, std::vector<std::size_t>{base::B, base::R_a});
  Model fitted = calibrate(records, held).model;
  ASSERT_EQ(fitted.base[base::B].value, 0);
  Model with_damping = held;
  given.base[base::B].value = half * Truth{}.B;
  with_damping.base[base::B].value = three_times * given.base[base::B].value;
  const double moved =
      std::abs(calibrate(records, with_damping).model.base[base::K_b].value - fitted.base[base::K_b].value);
  widen_by_held_damping(records, given, fitted);
  EXPECT_NEAR(z * *fitted.base[base::K_b].std_error, moved, 0.1 * moved);
  EXPECT_LT(std::abs(fitted.base[base::K_b].value - Truth{}.K_b), z * *fitted.base[base::K_b].std_error);
}

TEST(Gauge, ADampingThatIsHeldAboveNothingMayBeNothing) {
  constexpr double held_at = 2, z = 1.96;  // of the truth
  Model given = with_noise(servo_model());
  const auto records = prepared(speed_only(), given);
  given.base[base::B].value = held_at * Truth{}.B;
  given.base[base::B].fixed = given.base[base::B].pinned = true;
  given.base[base::R_a].fixed = given.base[base::R_a].pinned = true;
  Model without = given;
  without.base[base::B].value = 0;
  Model fitted = calibrate(records, given).model;
  const double moved = std::abs(calibrate(records, without).model.base[base::K_b].value - fitted.base[base::K_b].value);
  widen_by_held_damping(records, given, fitted);
  EXPECT_GT(z * *fitted.base[base::K_b].std_error, 0.9 * moved);
}

TEST(Gauge, APinIsFreeAgainWhereTheDataTellIt) {
  Model model = with_noise(servo_model());
  model.base[base::R_a].fixed = model.base[base::R_a].pinned = true;
  const auto with = prepared(with_current(), model), without = prepared(speed_only(), model);
  const auto freed = with_told_pins_free(with, calibrate(with, model).model);
  ASSERT_TRUE(freed);
  EXPECT_FALSE(freed->base[base::R_a].fixed);
  EXPECT_FALSE(with_told_pins_free(without, calibrate(without, model).model));
}

TEST(Gauge, PinsLieWhereAModelLeavesSomethingUntold) {
  Model model = with_noise(servo_model());
  const auto records = prepared(speed_only(), model);
  const std::vector<std::size_t> places = places_to_hold(records, calibrate(records, model).model);
  ASSERT_FALSE(places.empty());
  const Model held = calibrate(records, hold(records, model, model, places)).model;
  EXPECT_FALSE(with_pins_elsewhere(records, held)) << "they are those";
  Model other = held;
  other.base[places.front()].fixed = other.base[places.front()].pinned = false;
  EXPECT_FALSE(with_pins_elsewhere(records, other)) << "one more";
  other.base[base::K_b].fixed = other.base[base::K_b].pinned = true;  // which these runs tell
  const auto moved = with_pins_elsewhere(records, other);
  ASSERT_TRUE(moved);
  EXPECT_FALSE(moved->base[base::K_b].pinned);
  for (const std::size_t place : places) EXPECT_TRUE(moved->base[place].pinned) << place;
}

TEST(Gauge, WithoutPinsIsAsItWas) {
  Model model = servo_model();
  model.base[base::J].fixed = true;
  model.base[base::R_a].fixed = model.base[base::R_a].pinned = true;
  const Model free = without_pins(model);
  EXPECT_FALSE(free.base[base::R_a].fixed);
  EXPECT_FALSE(free.base[base::R_a].pinned);
  EXPECT_TRUE(free.base[base::J].fixed) << "by the user";
}

TEST(Identifiability, TheWidthOfAnEffectsBoundsIsNoScale) {
  Model model = with_noise(servo_model());
  const std::size_t windage = effect_index("windage");
  model.include(windage);
  model.parameters_of(windage)[0].value = 1e-8;
  ASSERT_GT(model.parameters_of(windage)[0].max, 1000);
  const Calibration c = calibrate(prepared(with_current(), model), model);
  for (const Undetermined& u : c.identifiability.undetermined) {
    EXPECT_EQ(u.combination, "+1.00 windage.c_w") << "B is known to " << *c.model.base[base::B].std_error;
    EXPECT_GT(u.relative_error, 0.3);
  }
}

TEST(Identifiability, AnInductanceThatNothingTellsIsNamed) {
  Model model = with_noise(servo_model());
  model.base[base::R_a].fixed = model.base[base::B].fixed = true;
  const std::size_t inductance = effect_index("armature_inductance");
  model.include(inductance);
  model.parameters_of(inductance)[0].value = 1e-7;
  std::vector<emtb::Run> slow{record({}, {{2, 1}, {2, 1.01}, {2, 1}}, 0.05, quiet)};
  slow[0].signals.erase(Signal::i_a);
  slow[0].signals.erase(Signal::e_a);
  const Calibration c = calibrate(prepared(slow, model), model);
  std::string words;
  for (const Undetermined& u : c.identifiability.undetermined) words += u.combination + "; ";
  EXPECT_THAT(words, HasSubstr("armature_inductance.L_a"));
}

}  // namespace
}  // namespace emtb::gauge_tests
