#include "analysis/numerics/lag_sums.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Normal {
  MatrixXd h = MatrixXd::Zero(2, 2);
  VectorXd g = VectorXd::Zero(2);
};

Normal normal_of(const LagSums& sums, const NoiseColour& colour) {
  Normal n;
  sums.weigh_into(n.h, n.g, colour);
  return n;
}

TEST(LagSums, TellNothingNegativeOfAStretchThatBeginsInATransient) {
  LagSums sums(2);
  VectorXd before(2);
  before << 100, 1;  // the last block of the stretch before
  for (const double s : {30.0, 9.0, 3.0, 1.0}) {
    VectorXd now(2);
    now << s, 1;
    sums.add(now, 0.1);
    sums.add_pair(before, 0.1, now, 0.1);
    before = now;
  }
  const Normal n = normal_of(sums, {.sigma = 1, .rho = 0.7});
  EXPECT_GT(Eigen::SelfAdjointEigenSolver<MatrixXd>(n.h).eigenvalues().minCoeff(), 0);
}

TEST(LagSums, LevelledDoNotTakeWhatSensitivitiesAndResidualsShareForInformation) {
  // A measured input whose noise is in both: s = 0.1 + n, r = n.
  const std::vector<double> noise = synthetic::coloured(4000, 0, 7);
  LagSums sums(2);
  for (const double v : noise) {
    VectorXd s(2);
    s << 0.1 + v, 1;
    sums.add(s, v);
  }
  const NoiseColour white{.sigma = 1, .rho = 0};
  const Normal biased = normal_of(sums, white);
  EXPECT_GT(biased.g[0] / std::sqrt(biased.h(0, 0)), 20) << "standard errors";
  sums.level();
  const Normal n = normal_of(sums, white);
  EXPECT_LT(std::abs(n.g[0] / std::sqrt(n.h(0, 0))), 3);
  EXPECT_NEAR(n.h(1, 1), biased.h(1, 1), 1e-9) << "what does not vary counts as before";
  EXPECT_NEAR(n.g[1], biased.g[1], 1e-9);
}

}  // namespace
}  // namespace emtb
