#include "analysis/diagnose/score.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/refit.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/residuals.h"
#include "model/catalogue.h"
#include "tests/analysis/diagnose/worn_coupling.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

/// A bench's given model, fitted, and the runs that it was fitted to.
struct FittedBench {
  Dataset data;
  Model model;
};

FittedBench fitted_on(const blind::Bench& bench) {
  Dataset data = prepare(record(bench, bench.train, 1), {}, bench.model);
  Model model = calibrate(data.train, bench.model).model;
  return {std::move(data), std::move(model)};
}

Score score_of(const FittedBench& bench, std::string_view effect) {
  return score(bench.data.train, bench.model, std::vector{effect_index(effect)}).front();
}

double squares_of(const FittedBench& bench, const Model& model) {
  return sum_of_squares(residuals(bench.data.train, model, model.values(), {}));
}

TEST(Score, ARefitStartsLowerThanTheFittedModelThoughViscousFrictionImitatesWindage) {
  blind::Bench windy = blind::fast_bench();
  windy.plant.motor.windage = 3e-8;  // [N m s2/rad2]
  const FittedBench bench = fitted_on(windy);
  const Score score = score_of(bench, "windage");
  Score::Start alone = score.starts.front();
  alone.others.clear();
  const double fitted = squares_of(bench, bench.model);
  const RefitStart start =
      *with_effect(bench.data.train, bench.model, fitted, effect_index("windage"), score.starts.front());
  EXPECT_LT(start.squares, 0.5 * fitted);
  EXPECT_NEAR(start.squares, squares_of(bench, start.model), 1e-6 * fitted);
  EXPECT_LT(start.model.base[base::B].value, bench.model.base[base::B].value) << "B has to make room";
  const RefitStart crowded = *with_effect(bench.data.train, bench.model, fitted, effect_index("windage"), alone);
  EXPECT_LT(crowded.squares, fitted) << "as much of the way as lowers it";
}

TEST(Score, ARefitDoesNotStartWhereNothingCanBeSimulated) {
  const FittedBench bench = fitted_on(blind::fast_bench());
  const double J = bench.model.base[base::J].value;
  const std::vector<double> coupling{0.9, 0.002, 1.01 * J};  // [N m/rad], [N m s/rad], [kg m2] of the load's share of J
  const Score::Start heavier{coupling, coupling, {}};
  EXPECT_FALSE(with_effect(bench.data.train, bench.model, squares_of(bench, bench.model),
                           effect_index("shaft_compliance"), heavier));
}

TEST(Score, APlayOfTheCouplingIsTriedAtSizesOfItsOwn) {
  const FittedBench bench = fitted_on(worn_coupling(0.5, 0.08, std::array{0.5, 2e-4, 2e-5}));
  const Score score = score_of(bench, "backlash");
  EXPECT_GT(score.predicted_drop, 0.2 * squares_of(bench, bench.model));
  EXPECT_GE(score.expected()[0], 0.03);
  EXPECT_LE(score.expected()[0], 0.3);
  EXPECT_GT(score.starts.size(), 1U);
}

TEST(Score, APlayMeansNothingWithoutACoupling) {
  const FittedBench bench = fitted_on(blind::fast_bench());
  const Score score = score_of(bench, "backlash");
  EXPECT_EQ(score.predicted_drop, 0);
  EXPECT_EQ(score.p_value, 1);
}

}  // namespace
}  // namespace emtb
