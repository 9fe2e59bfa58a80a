#include "analysis/numerics/linear_algebra.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>

namespace emtb {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd gram(const MatrixPart& a) {
  MatrixXd sum = MatrixXd::Zero(a.cols(), a.cols());
  sum.selfadjointView<Eigen::Lower>().rankUpdate(a.transpose());
  sum.triangularView<Eigen::StrictlyUpper>() = sum.transpose();
  return sum;
}

MatrixXd transposed_product(const MatrixPart& a, const MatrixPart& b) { return a.transpose() * b; }
MatrixXd product(const MatrixXd& a, const MatrixXd& b) { return a * b; }

MatrixXd least_squares(const MatrixXd& a, const MatrixXd& b) { return a.completeOrthogonalDecomposition().solve(b); }
MatrixXd solve_normal(const MatrixXd& a, const MatrixXd& b) {
  const VectorXd inverse_size = a.diagonal().cwiseSqrt().cwiseMax(1e-150).cwiseInverse();
  const MatrixXd scaled = inverse_size.asDiagonal() * a * inverse_size.asDiagonal();
  return inverse_size.asDiagonal() * least_squares(scaled, inverse_size.asDiagonal() * b);
}

MatrixXd pseudo_inverse(const MatrixXd& a) {
  if (a.rows() <= a.cols()) return a.completeOrthogonalDecomposition().pseudoInverse();
  // Of a tall one Eigen would solve for an identity of as many columns as there are rows.
  const Eigen::HouseholderQR<MatrixXd> qr(a);
  const MatrixXd r = qr.matrixQR().topRows(a.cols()).triangularView<Eigen::Upper>();
  const MatrixXd q = qr.householderQ() * MatrixXd::Identity(a.rows(), a.cols());
  return r.completeOrthogonalDecomposition().pseudoInverse() * q.transpose();
}

MatrixXd scaled_inverse(const MatrixXd& a) {
  const VectorXd size = a.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigensystem eigen = eigensystem(size.asDiagonal() * a * size.asDiagonal());
  const double rounding = 1e-14 * eigen.values.maxCoeff();
  const MatrixXd root =
      size.asDiagonal() * eigen.vectors * eigen.values.cwiseMax(rounding).cwiseSqrt().cwiseInverse().asDiagonal();
  return product(root, root.transpose());
}

MatrixXd cholesky(const MatrixXd& a) { return Eigen::LLT<MatrixXd>(a).matrixL(); }
VectorXd solve_lower(const MatrixXd& l, const VectorXd& b) { return l.triangularView<Eigen::Lower>().solve(b); }

Eigensystem eigensystem(const MatrixXd& symmetric) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solved(symmetric);
  return {solved.eigenvalues(), solved.eigenvectors()};
}

}  // namespace emtb
