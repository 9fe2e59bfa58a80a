#pragma once

/// Dense linear algebra of a few tens of unknowns, as plain functions: each of Eigen's decompositions and products is
/// compiled once, here, and not again in every file that needs it.

#include <Eigen/Core>
#include <cstddef>

namespace emtb {

/// Eigen counts with a sign.
constexpr Eigen::Index as_index(std::size_t j) { return static_cast<Eigen::Index>(j); }

/// A matrix, or a part of one.
using MatrixPart = Eigen::Ref<const Eigen::MatrixXd>;

/// AᵀA.
Eigen::MatrixXd gram(const MatrixPart& a);

/// AᵀB, the heights alike; B may be a vector.
Eigen::MatrixXd transposed_product(const MatrixPart& a, const MatrixPart& b);

/// A B; B may be a vector.
Eigen::MatrixXd product(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The X of least norm that minimizes |A X - B|, by complete orthogonal decomposition.
Eigen::MatrixXd least_squares(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The X of normal equations A X = B, A = SᵀS, scaled against the different sizes of the parameters; where A is
/// singular, the one of least norm.
Eigen::MatrixXd solve_normal(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b);

/// The Moore-Penrose inverse, by complete orthogonal decomposition.
Eigen::MatrixXd pseudo_inverse(const Eigen::MatrixXd& a);

/// A⁻¹ of a symmetric, positive A whose rows may be of very different sizes.
Eigen::MatrixXd scaled_inverse(const Eigen::MatrixXd& a);

/// The lower triangle L of A = L Lᵀ, A symmetric and positive definite.
Eigen::MatrixXd cholesky(const Eigen::MatrixXd& a);

/// L⁻¹ b of a lower triangle.
Eigen::VectorXd solve_lower(const Eigen::MatrixXd& l, const Eigen::VectorXd& b);

/// Eigenvalues of a symmetric matrix, rising, and the eigenvectors, one a column.
struct Eigensystem {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
Eigensystem eigensystem(const Eigen::MatrixXd& symmetric);

}  // namespace emtb
