#include "analysis/fit/normal_equations.h"

#include <gtest/gtest.h>

#include "analysis/numerics/linear_algebra.h"
#include "analysis/record/dataset.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// A servo that cogs beside runs of one that does not, from anywhere in a turn.
struct Turning {
  Model model = synthetic::servo_model();
  std::vector<Record> records;

  Turning() {
    model.include(effect_index("cogging"));
    const std::vector<double> cogging{0.002, 6.0, 0.3};
    for (std::size_t i = 0; i < cogging.size(); ++i) model.at(5 + i).value = cogging[i];
    constexpr synthetic::Sigma read{.omega = 0.1, .i_a = 0.01, .e_a = 0.02};
    const std::vector<emtb::Run> runs{synthetic::record({}, synthetic::steps, 1e-3, read),
                                      synthetic::record({}, {{0.2, 0}, {0.6, 4}, {0.4, 1}}, 1e-3, read)};
    records = prepare(runs, {}, model).train;
    for (Record& record : records) record.angle_wander = 0;
  }
};

TEST(NormalEquations, AreThoseOfTheResidualsAtTheirPhases) {
  const Turning c;
  const CalibrationOptions options;
  const FitProblem problem(c.records, c.model, options);
  const std::vector<double> x = problem.free().pick({});
  const NormalEquations summed = problem.normal_equations(x, true, false);
  ASSERT_EQ(problem.phases().size(), 2U);
  NormalEquations kept;
  kept.sts.setZero(summed.sts.rows(), summed.sts.cols());
  kept.str.setZero(summed.str.size());
  for (std::size_t i = 0; i < c.records.size(); ++i) {
    ASSERT_EQ(problem.phases()[i].at.size(), 1U);
    for (const Residuals& r : residuals_at_phase(c.records[i], c.records[i].structure(c.model), c.model.values(),
                                                 moved_by(problem.free()), problem.phases()[i])
                                  .residuals) {
      kept.rtr += r.value.squaredNorm();
      if (!r.informed()) continue;
      kept.sts += gram(r.sensitivity);
      kept.str += transposed_product(r.sensitivity, r.value);
    }
  }
  EXPECT_NEAR(summed.rtr, kept.rtr, 1e-9 * kept.rtr);
  const Eigen::VectorXd size = kept.sts.diagonal().cwiseSqrt();
  EXPECT_LT((summed.sts - kept.sts).cwiseQuotient(size * size.transpose()).cwiseAbs().maxCoeff(), 1e-6);
  EXPECT_LT((summed.str - kept.str).cwiseQuotient(size).cwiseAbs().maxCoeff(), 1e-6 * std::sqrt(kept.rtr));
}

TEST(NormalEquations, OfEachRecordMakeUpTheWhole) {
  const Turning c;
  const CalibrationOptions options;
  const FitProblem problem(c.records, c.model, options);
  const std::vector<double> x = problem.free().pick({});
  const std::vector<NormalEquations> each = problem.of_each(x, true);
  ASSERT_EQ(each.size(), 2U);
  const NormalEquations all = problem.sum_of(each, x);
  EXPECT_DOUBLE_EQ(all.rtr, each[0].rtr + each[1].rtr);
  EXPECT_EQ(all.sts, each[0].sts + each[1].sts);
}

TEST(NormalEquations, FollowThePhasesAsTheParametersChange) {
  const Turning c;
  const CalibrationOptions options;
  const FitProblem problem(c.records, c.model, options);
  std::vector<double> x = problem.free().pick({});
  const double before = problem.normal_equations(x, true, false).rtr;
  const std::size_t phase = x.size() - 1;
  x[phase] += 0.6;  // [rad] of a wave: the rotors stand a sixth of that further back
  const double after = problem.normal_equations(x, true, false).rtr;
  EXPECT_NEAR(after, before, 1e-3 * before);
}

}  // namespace
}  // namespace emtb
