#include "analysis/diagnose/joint_refit.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "model/catalogue.h"
#include "tests/analysis/diagnose/worn_coupling.h"

namespace emtb {
namespace {

const std::size_t backlash = effect_index("backlash"), compliance = effect_index("shaft_compliance");

/// Runs of a coupling with a play [rad], and a model that has fitted its spring to them without it.
struct Worn {
  Dataset data;
  Fit fitted;
};

Worn fitted_without_the_play(double gap) {
  const blind::Bench bench = worn_coupling(0.05, gap, std::array{0.035, 3e-4, 3e-5});
  Dataset data = prepare(record(bench, bench.train, 1), {}, bench.model);
  Fit fitted = calibrate(data.train, bench.model, {.extra_starts = 0});
  return {std::move(data), std::move(fitted)};
}

double gap_of(const Fit& fit) { return fit.model.parameters_of(backlash)[0].value; }

TEST(JointRefit, APlayIsFoundThoughTheSpringHasBentToDoWithoutIt) {
  for (const double gap : {0.5, 2.0}) {
    const Worn worn = fitted_without_the_play(gap);
    const Fit begun = begun_together(worn.data.train, worn.fitted, backlash, worn.fitted.phases, nullptr);
    EXPECT_LT(begun.cost, 0.2 * worn.fitted.cost) << gap;
    EXPECT_NEAR(gap_of(begun), gap, 0.15 * gap);
    EXPECT_NEAR(begun.model.parameters_of(compliance)[0].value, 0.05, 0.005) << gap;
  }
}

TEST(JointRefit, AValleyThatIsKnownIsGoneOnFromThoughTheFitHasMoved) {
  const Worn worn = fitted_without_the_play(0.5);
  const Fit found = begun_together(worn.data.train, worn.fitted, backlash, worn.fitted.phases, nullptr);
  const Valley valley = valley_of(found.model, backlash);
  Fit elsewhere = worn.fitted;
  elsewhere.model.base[base::J].value *= 1.5;
  for (Parameter& p : elsewhere.model.parameters_of(compliance)) p.value *= 3;
  const Fit again = begun_together(worn.data.train, elsewhere, backlash, worn.fitted.phases, &valley);
  EXPECT_LE(again.cost, found.cost);
}

TEST(JointRefit, OnlyWhatActsWithinAnotherEffectOfTheModelIsBegunWithIt) {
  Model model = blind::fast_bench().model;
  EXPECT_FALSE(acts_within_another(model, backlash)) << "a play of what?";
  model.include(compliance);
  EXPECT_TRUE(acts_within_another(model, backlash));
  EXPECT_FALSE(acts_within_another(model, effect_index("stribeck_friction")));
  EXPECT_THAT(valley_of(model, compliance).needed, testing::IsEmpty());
}

}  // namespace
}  // namespace emtb
