#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "analysis/diagnose/diagnose.h"
#include "model/catalogue.h"
#include "tests/blind/recording.h"

namespace emtb::gauge_tests {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::vector<std::string> named(const Diagnosis& d) {
  std::vector<std::string> ids;
  for (const MissingEffect& m : d.missing) {
    ids.push_back(d.id(m.effect));
    for (const std::size_t rival : m.tied_with) ids.push_back(d.id(rival));
  }
  return ids;
}

std::vector<std::string> held(const Diagnosis& d) {
  std::vector<std::string> names;
  for (const Pin& pin : d.pins) names.push_back(pin.parameter);
  return names;
}

/// The fast bench with dry friction, whose current nobody measured.
Diagnosis without_current(double R_a /* ohm, as given */, double T_c) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction.T_c = T_c;
  std::erase_if(bench.channels,
                [](const simulated::DaqChannel& c) { return c.signal == Signal::i_a || c.signal == Signal::torque; });
  bench.model.base[base::R_a].value = R_a;
  return diagnose(record(bench, bench.train, 1), record(bench, bench.held_out, 101), bench.model);
}

struct Ratios {
  double T_c_to_J = 0, J_R_a = 0, R_a_T_c = 0;
};
Ratios ratios_of(const Diagnosis& d) {
  const std::vector<double> p = d.final.values();
  const double T_c = d.final.parameters_of(effect_index("coulomb_friction"))[0].value;
  return {T_c / p[base::J], p[base::J] * p[base::R_a] / p[base::K_b], T_c * p[base::R_a] / p[base::K_b]};
}

TEST(DiagnoseGauge, NamesDryFrictionWithoutACurrentAndItsRatiosDoNotHangOnThePin) {
  constexpr double T_c = 0.003, J = 6e-5;  // [N m], [kg m2] of the plant
  const Diagnosis one = without_current(1, T_c), three = without_current(3, T_c);
  EXPECT_THAT(held(one), ElementsAre("R_a", "B"));
  EXPECT_EQ(one.pins[0].value, 1);
  EXPECT_EQ(three.pins[0].value, 3);
  ASSERT_FALSE(one.missing.empty());
  EXPECT_THAT(named(one), testing::Contains("coulomb_friction"));
  EXPECT_EQ(named(one), named(three));
  EXPECT_EQ(one.verdict, three.verdict);
  EXPECT_NEAR(one.final_held_out, three.final_held_out, 1e-3);
  ASSERT_TRUE(one.final.includes(effect_index("coulomb_friction")));
  const Ratios a = ratios_of(one), b = ratios_of(three);
  EXPECT_NEAR(b.T_c_to_J / a.T_c_to_J, 1, 1e-3);
  EXPECT_NEAR(b.J_R_a / a.J_R_a, 1, 1e-3);
  EXPECT_NEAR(b.R_a_T_c / a.R_a_T_c, 1, 1e-3);
  const Parameter& found = one.final.parameters_of(effect_index("coulomb_friction"))[0];
  ASSERT_TRUE(found.std_error);
  EXPECT_NEAR(a.T_c_to_J, T_c / J, 3 * *found.std_error / one.final.base[base::J].value + 0.01 * T_c / J);
  EXPECT_THAT(scaled_with(one.pins, "coulomb_friction.T_c"), testing::Contains("R_a"));
}

TEST(DiagnoseGauge, HoldsNothingWhereTheCurrentIsMeasured) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction.T_c = 0.003;
  const Diagnosis d = diagnose(record(bench, bench.train, 1), record(bench, bench.held_out, 101), bench.model);
  EXPECT_THAT(held(d), IsEmpty());
  for (std::size_t i = 0; i < d.final.names().size(); ++i) EXPECT_FALSE(d.final.at(i).pinned);
  EXPECT_THAT(named(d), ElementsAre("coulomb_friction"));
}

TEST(DiagnoseGauge, FreesWhatAnEffectLetsTheDataTell) {
  // Without the driver's block, the shaft seems to be braked by nothing: B is held there, and another brake would stand
  // in for it. A shaft that coasts tells it, but for the scale of all torques, which nothing tells.
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.one_quadrant = true;
  const std::vector<double> levels{1.5, 0.7};  // the second tells it from one that lets go at zero alone
  std::erase_if(bench.channels, [](const simulated::DaqChannel& c) { return c.signal != Signal::omega; });
  bench.train = {step("fast", 3, 1, 3, 12), staircase("down", levels, 1, 3, 12)};
  bench.held_out = {step("between", 2, 1, 3, 12)};
  const Diagnosis d = diagnose(record(bench, bench.train, 1), record(bench, bench.held_out, 101), bench.model);
  EXPECT_THAT(named(d), ElementsAre("one_quadrant_driver"));
  EXPECT_EQ(held(d).size(), 1U);
  const auto& motor = bench.plant.motor;
  const auto value = [&](std::size_t place) { return d.final.base[place].value; };
  EXPECT_NEAR(value(base::R_a) * value(base::B) / (motor.R_a * motor.B), 1, 0.1);
  EXPECT_NEAR(value(base::J) / value(base::B) / (motor.J / motor.B), 1, 0.1);
}

}  // namespace
}  // namespace emtb::gauge_tests
