#include "config/model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "model/catalogue.h"
#include "tests/config/complains.h"

namespace emtb {
namespace {

using testing::HasSubstr;

constexpr const char* fh2 =
    "name: fh2\n"
    "driver: {gain: 18.333, rise: 22.5, fall: 20.4, min: 0, max: 110}\n"
    "tie: {K_m: K_b}\n"
    "parameters:\n"
    "  R_a: {value: 31.8, min: 5, max: 100, unit: ohm, prior: {value: 30, std: 1}, std_error: 0.04}\n"
    "  K_b: {value: 0.67, min: 0.1, max: 2, unit: V s/rad}\n"
    "  B: {value: 1.0e-4, fixed: true}\n"
    "  J: {value: 3.4e-3, min: 2.0e-4, max: 0.1, unit: kg m2}\n"
    "noise: {omega: 0.15}\n"
    "effects:\n"
    "  tacho_lag: {tau: {value: 0.02, min: 0, max: 1, unit: s}}\n"
    "  coulomb_friction: {T_c: {value: 0.05, min: 0, max: 1, unit: N m}}\n"
    "history:\n"
    "  - {action: added coulomb_friction, train: 1.01, held_out: 1.02, sessions: [a.csv, b.h5@1:2]}\n";

Model model_of(const std::string& text) { return read_model(YamlMap::parse(text, "m.yaml")); }

std::string complaint_about(const std::string& from, const std::string& to) {
  std::string text = fh2;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return complaint([&] { model_of(text); });
}

void expect_all(const Model& m) {
  EXPECT_EQ(m.name, "fh2");
  EXPECT_EQ(m.input, Signal::u_ref);
  ASSERT_TRUE(m.driver);
  EXPECT_DOUBLE_EQ(m.driver->fall, 20.4);
  EXPECT_EQ(m.values(), (std::vector<double>{31.8, 0.67, 0.67, 1e-4, 3.4e-3, 0.05, 0.02}))
      << "tied, in the order of the stages";
  ASSERT_TRUE(m.base[base::R_a].prior);
  EXPECT_DOUBLE_EQ(m.base[base::R_a].prior->std, 1);
  EXPECT_EQ(m.base[base::R_a].std_error, 0.04);
  EXPECT_TRUE(m.base[base::B].fixed);
  EXPECT_DOUBLE_EQ(m.noise.at(Signal::omega), 0.15);
  ASSERT_EQ(m.effects.size(), 2U);
  EXPECT_EQ(m.effects[0].effect, effect_index("coulomb_friction"));
  EXPECT_DOUBLE_EQ(m.effects[0].parameters[0].max, 1);
  ASSERT_EQ(m.history.size(), 1U);
  EXPECT_EQ(m.history[0].held_out, 1.02);
  EXPECT_EQ(m.history[0].sessions.back(), "b.h5@1:2");
}

TEST(ModelFile, ReadsAll) { expect_all(model_of(fh2)); }

TEST(ModelFile, ReadsBackWhatItWrites) { expect_all(model_of(to_yaml(model_of(fh2)))); }

TEST(ModelFile, SaysOfTheBenchWhatNoReadingTells) {
  const Model silent = model_of(fh2);
  EXPECT_FALSE(silent.bench.field_winding || silent.bench.tachogenerator);
  const Model told = model_of(to_yaml(model_of(std::string(fh2) + "bench: {field: magnets, speed: encoder}\n")));
  EXPECT_EQ(told.bench.field_winding, false);
  EXPECT_EQ(told.bench.tachogenerator, false);
  const Model wound = model_of(to_yaml(model_of(std::string(fh2) + "bench: {field: winding}\n")));
  EXPECT_EQ(wound.bench.field_winding, true);
  EXPECT_FALSE(wound.bench.tachogenerator);
}

TEST(ModelFile, ReadsEveryModelAsShipped) {
  for (const auto& entry : std::filesystem::directory_iterator(EMTB_SOURCE_DIR "/config/models")) {
    EXPECT_NO_THROW(read_model(entry.path())) << entry.path();
  }
}

TEST(ModelFile, NeedsNoCircuitForACurrentDrive) {
  const Model m = model_of(
      "input: i_a\nparameters: {K_m: {value: 35, fixed: true}, B: {value: 1, min: 0, max: 9}, J: {value: 5, min: 1, "
      "max: 9}}\n");
  EXPECT_EQ(FreeParameters(m).size(), 2U);
}

TEST(ModelFile, GivesAnEffectWithoutNumbersItsNullAndTheCataloguesBounds) {
  const Model m = model_of(std::string(fh2).replace(
      std::string(fh2).find("tacho_lag: {tau: {value: 0.02, min: 0, max: 1, unit: s}}"), 56, "tacho_lag: {}"));
  EXPECT_DOUBLE_EQ(m.values().back(), 0);
}

TEST(ModelFile, ComplaintsNameFileLineAndKeyAndWhatWouldBeRight) {
  EXPECT_THAT(complaint_about("value: 31.8", "value: 200"),
              HasSubstr("m.yaml:5: parameters.R_a.value is 200 ohm, outside its bounds 5 to 100"));
  EXPECT_THAT(complaint_about("unit: kg m2", "unit: g m2"), HasSubstr("J is in kg m2"));
  EXPECT_THAT(complaint_about("min: 2.0e-4", "min: 0"), HasSubstr("which cannot be"));
  EXPECT_THAT(complaint_about("  J:", "  I:"), HasSubstr("parameters.I is not known here. Known: R_a, K_b, K_m, B, J"));
  EXPECT_THAT(complaint_about("tie: {K_m: K_b}", "tie: {}"),
              HasSubstr("parameters.K_m is missing. Add it, or write `tie: {K_m: K_b}`"));
  EXPECT_THAT(complaint_about("tie: {K_m: K_b}", "tie: {K_m: K_c}"), HasSubstr("K_c"));
  EXPECT_THAT(complaint_about("T_c: {", "T_x: {"), HasSubstr("T_x is not a parameter of coulomb_friction"));
  EXPECT_THAT(complaint_about("tacho_lag", "gremlins"), HasSubstr("m.yaml:11: effects.gremlins is an unknown effect"));
  EXPECT_THAT(complaint_about("tacho_lag", "tacho_leg"), HasSubstr("did you mean tacho_lag? A formula of your own: "));
  EXPECT_THAT(complaint_about("noise: {omega: 0.15}", "noise: {omega: 0}"), HasSubstr("noise.omega"));
  EXPECT_THAT(complaint_about("rise: 22.5", "rise: -1"), HasSubstr("driver.rise"));
  EXPECT_THAT(complaint_about("min: 5, max: 100, unit: ohm, ", ""), HasSubstr("needs min and max (or fixed: true)"));
}

TEST(ModelFile, WhatIsNoNumberIsNeverWrittenAsOne) {
  Model model = model_of(fh2);
  model.history.push_back({"added backlash", 1.5, std::nan(""), {"a.h5"}});
  const Model back = model_of(to_yaml(model));
  EXPECT_EQ(back.history.back().train, 1.5);
  EXPECT_FALSE(back.history.back().held_out);
}

}  // namespace
}  // namespace emtb
