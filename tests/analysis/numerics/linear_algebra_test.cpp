#include "analysis/numerics/linear_algebra.h"

#include <gtest/gtest.h>

#include <cmath>

namespace emtb {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

/// Four rows, three columns, of full rank.
MatrixXd tall() {
  MatrixXd a(4, 3);
  a << 1, 2, 0,  //
      0, 1, -1,  //
      3, 0, 1,   //
      1, 1, 2;
  return a;
}

/// The third column is the sum of the others.
MatrixXd dependent() {
  MatrixXd a = tall();
  a.col(2) = a.col(0) + a.col(1);
  return a;
}

TEST(LinearAlgebra, ProductsAreThoseOfTheTextbook) {
  const MatrixXd a = tall();
  EXPECT_TRUE(gram(a).isApprox(a.transpose() * a, 1e-14));
  EXPECT_EQ(gram(a)(0, 1), gram(a)(1, 0)) << "exactly symmetric";
  EXPECT_TRUE(transposed_product(a, dependent()).isApprox(a.transpose() * dependent(), 1e-14));
  EXPECT_TRUE(product(a, gram(a)).isApprox(a * gram(a), 1e-14));
}

TEST(LeastSquares, LeavesAResidualAtRightAnglesToTheColumns) {
  const MatrixXd a = tall();
  const VectorXd b = VectorXd::LinSpaced(4, -1, 5);
  const VectorXd x = least_squares(a, b);
  EXPECT_GT((b - a * x).norm(), 0.1) << "four equations in three unknowns do not fit";
  EXPECT_LT((a.transpose() * (b - a * x)).norm(), 1e-12);
}

TEST(LeastSquares, TakesTheShortestOfManySolutions) {
  const MatrixXd a = dependent();
  const VectorXd b = a * VectorXd::Ones(3);
  const VectorXd x = least_squares(a, b);
  EXPECT_LT((a * x - b).norm(), 1e-12);
  const VectorXd free_direction{{1.0, 1.0, -1.0}};
  EXPECT_NEAR(x.dot(free_direction), 0, 1e-12) << "nothing of what a x does not see";
}

TEST(SolveNormal, AgreesWithTheLeastSquaresThatItStandsFor) {
  const MatrixXd a = tall();
  const VectorXd b = VectorXd::LinSpaced(4, -1, 5);
  EXPECT_TRUE(solve_normal(gram(a), transposed_product(a, b)).isApprox(least_squares(a, b), 1e-10));
}

TEST(SolveNormal, DoesNotMindUnknownsOfVeryDifferentSize) {
  const VectorXd size{{1e-6, 1.0, 1e6}};
  const MatrixXd a = tall() * size.asDiagonal();
  const VectorXd truth = size.cwiseInverse();
  const VectorXd x = solve_normal(gram(a), transposed_product(a, a * truth));
  EXPECT_TRUE(x.cwiseProduct(size).isApprox(VectorXd::Ones(3), 1e-9));
}

TEST(SolveNormal, StaysFiniteWhereNothingDeterminesAnUnknown) {
  MatrixXd a = tall();
  a.col(1).setZero();
  const VectorXd x = solve_normal(gram(a), transposed_product(a, VectorXd::Ones(4)));
  EXPECT_TRUE(x.allFinite());
  EXPECT_EQ(x[1], 0);
}

TEST(PseudoInverse, IsTheOneOfMooreAndPenrose) {
  for (const MatrixXd& a : {tall(), dependent()}) {
    const MatrixXd p = pseudo_inverse(a);
    EXPECT_TRUE((a * p * a).isApprox(a, 1e-12));
    EXPECT_TRUE((p * a * p).isApprox(p, 1e-12));
    EXPECT_TRUE((a * p).isApprox((a * p).transpose(), 1e-12));
    EXPECT_TRUE((p * a).isApprox((p * a).transpose(), 1e-12));
  }
}

TEST(Cholesky, GivesATriangleWhoseSquareIsTheMatrix) {
  const MatrixXd s = gram(tall());
  const MatrixXd l = cholesky(s);
  EXPECT_TRUE((l * l.transpose()).isApprox(s, 1e-12));
  EXPECT_EQ(l(0, 1), 0);
  EXPECT_EQ(l(1, 2), 0);
  const VectorXd b = VectorXd::LinSpaced(3, 1, 3);
  EXPECT_TRUE((l * solve_lower(l, b)).isApprox(b, 1e-12));
}

TEST(Eigensystem, RisesAndPutsTheMatrixTogetherAgain) {
  const MatrixXd s = gram(tall());
  const Eigensystem e = eigensystem(s);
  EXPECT_LE(e.values[0], e.values[1]);
  EXPECT_LE(e.values[1], e.values[2]);
  EXPECT_TRUE((e.vectors * e.values.asDiagonal() * e.vectors.transpose()).isApprox(s, 1e-12));
  EXPECT_TRUE((e.vectors.transpose() * e.vectors).isIdentity(1e-12));
}

}  // namespace
}  // namespace emtb
