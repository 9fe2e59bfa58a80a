#include "analysis/diagnose/tied_values.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// A servo with this resistance, told to 0.01 ohm.
Model with_resistance(double R_a) {
  Model model = synthetic::servo_model();
  model.at(base::R_a).value = R_a;
  model.at(base::R_a).std_error = 0.01;
  return model;
}

double error_of_resistance(Model fitted, const std::vector<Model>& rivals) {
  widen_by_ties(rivals, fitted);
  return fitted.at(base::R_a).std_error.value();
}

TEST(ErrorUnderATie, HoldsBothValues) {
  const double error = error_of_resistance(with_resistance(1), {with_resistance(1.2)});
  EXPECT_NEAR(error, std::hypot(0.01, 0.2 / std::sqrt(2)), 1e-12);
  EXPECT_GT(1.96 * error, 0.2);
}

TEST(ErrorUnderATie, CountsEachRivalAsLikelyAsTheModel) {
  const double error = error_of_resistance(with_resistance(1), {with_resistance(1.2), with_resistance(1)});
  EXPECT_NEAR(error, std::hypot(0.01, 0.2 / std::sqrt(3)), 1e-12);
}

TEST(ErrorUnderATie, StaysWhereNothingIsTied) { EXPECT_EQ(error_of_resistance(with_resistance(1), {}), 0.01); }

TEST(ErrorUnderATie, TakesNothingFromWhatARivalHolds) {
  Model pinned = with_resistance(2), fixed = with_resistance(2);
  pinned.at(base::R_a).pinned = true;
  fixed.at(base::R_a).fixed = true;
  EXPECT_EQ(error_of_resistance(with_resistance(1), {pinned, fixed}), 0.01);
}

TEST(ErrorUnderATie, IsOfTheEffectsThatBothHave) {
  Model model = with_resistance(1), rival = with_resistance(1);
  for (Model* with : {&model, &rival}) with->include(effect_index("coulomb_friction"));
  rival.include(effect_index("windage"));
  const std::size_t T_c = ModelStructure::base_count;
  model.at(T_c).value = 0.02;
  model.at(T_c).std_error = 0;
  rival.at(T_c).value = 0.04;
  widen_by_ties(std::vector{rival}, model);
  EXPECT_NEAR(model.at(T_c).std_error.value(), 0.02 / std::sqrt(2), 1e-12);
}

TEST(ValuesThatDiffer, AreThoseThatAUserWouldTakeForWrong) {
  const Model model = with_resistance(1);
  const std::size_t effect = effect_index("armature_inductance");
  const std::vector<OtherValue> other = values_that_differ(model, with_resistance(1.2), effect);
  ASSERT_EQ(other.size(), 1U);
  EXPECT_EQ(other[0].name, "R_a");
  EXPECT_EQ(other[0].value, 1.2);
  EXPECT_EQ(other[0].effect, effect);
  EXPECT_TRUE(values_that_differ(model, with_resistance(1.015), effect).empty()) << "within its errors";
  Model sure = model;
  sure.at(base::R_a).std_error = 1e-6;
  EXPECT_TRUE(values_that_differ(sure, with_resistance(1.005), effect).empty()) << "less than a hundredth";
}

}  // namespace
}  // namespace emtb
