#include "report/gauge_words.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

#include "report/result_json.h"

namespace emtb::gauge_words_tests {
namespace {

using testing::HasSubstr;
using testing::Not;

Pin resistance() {
  return {.place = base::R_a,
          .parameter = "R_a",
          .value = 5,
          .unit = "ohm",
          .followers = {{"J", -1.001}, {"coulomb_friction.T_c", -0.998}},
          .current_read = false};
}

Model motor() {
  Model m;
  for (const BaseParameter& b : base_parameters) {
    Parameter p;
    p.symbol = b.symbol;
    p.value = 1;
    m.base.push_back(p);
  }
  m.tie = {{"K_m", "K_b"}};
  return m;
}

TEST(GaugeWords, APinIsSaidWithWhatIsToldInItsPlaceAndWhatWouldTellIt) {
  EXPECT_EQ(
      in_words(resistance()),
      "R_a is held at 5 ohm: without a measured current these runs tell J R_a and T_c R_a only. To tell it, measure "
      "i_a, or give the model what is known of R_a (fixed: true, or prior: {value, std}).");
}

TEST(GaugeWords, WhereTheCurrentIsKnownNobodyIsToldToMeasureIt) {
  Pin inertia{
      .place = base::J, .parameter = "J", .value = 2, .unit = "kg m2", .followers = {{"B", 1}}, .current_read = true};
  EXPECT_THAT(in_words(inertia), HasSubstr("these runs tell B/J only"));
  EXPECT_THAT(in_words(inertia), Not(HasSubstr("measure")));
  inertia.followers.clear();
  EXPECT_THAT(in_words(inertia), HasSubstr("these runs tell nothing of it"));
}

TEST(GaugeWords, WhatIsNoFactorIsNoRatio) {
  Pin friction{.place = base::B, .parameter = "B", .value = 0, .unit = "N m s/rad", .followers = {{"K_b", -1}}};
  EXPECT_THAT(in_words(friction), HasSubstr("these runs do not tell it from K_b"));
  Pin other = resistance();
  other.followers.push_back({"K_b", -0.4});
  EXPECT_THAT(in_words(other), HasSubstr("do not tell it from J, T_c and K_b"));
}

TEST(GaugeWords, AdviceNamesTheParameterThatIsEasiestToKnow) {
  const std::vector<Undetermined> open{{"+0.71 R_a  -0.71 J", infinity}};
  EXPECT_EQ(advice_on(open, motor(), {}), "fix R_a (fixed: true, or prior: {value, std}), or measure i_a");
  EXPECT_THAT(advice_on(open, motor(), {.current = true, .torque = false}), Not(HasSubstr("i_a")));
  EXPECT_EQ(in_words(open[0]),
            "These data do not determine +0.71 R_a  -0.71 J (relative changes): anything fits as well");
  EXPECT_EQ(in_words(Undetermined{"+1.00 B", 0.5}), "These data do not determine B: +-50 %");
}

TEST(GaugeWords, AnErrorThatSaysNothingIsSaidInWords) {
  Parameter p;
  p.value = 1.5;
  EXPECT_EQ(error_in_words(p, true), "not determined");
  EXPECT_EQ(error_in_words(p, false), "-");
  p.std_error = 3.3e-102;
  EXPECT_EQ(error_in_words(p, true), "not determined");
  p.std_error = 6.596e9;
  EXPECT_EQ(error_in_words(p, true), "not determined");
  p.std_error = 0.03;
  EXPECT_EQ(error_in_words(p, true), "0.03");
}

TEST(GaugeWords, JsonMarksWhatIsHeldAndWhatGoesWithIt) {
  Model m = motor();
  m.base[base::R_a].fixed = m.base[base::R_a].pinned = true;
  const std::vector<Pin> pins{resistance()};
  const auto json = parameters_json(m, {}, pins);
  EXPECT_EQ(json["R_a"]["pinned"], true);
  EXPECT_EQ(json["J"]["scaled_with"], std::vector<std::string>{"R_a"});
  EXPECT_FALSE(json["K_b"].contains("scaled_with"));
  EXPECT_FALSE(json["J"].contains("pinned"));
}

}  // namespace
}  // namespace emtb::gauge_words_tests
