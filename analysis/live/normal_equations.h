#pragma once

#include <Eigen/Core>
#include <span>

#include "analysis/live/sums.h"

namespace emtb {

/// H x = g of a least-squares problem: H is the information about the unknowns x.
struct NormalEquations {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;

  static NormalEquations zero(Eigen::Index unknowns);

  /// Adds what the sums of each output tell. @param colours of the outputs
  void add(std::span<const LagSums> outputs, std::span<const Colour> colours);
  NormalEquations& operator+=(const NormalEquations& other);
  bool finite() const { return h.allFinite() && g.allFinite(); }
};

/// A⁻¹ of a symmetric, positive A whose rows may be of very different sizes.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a);

/// The step that minimizes ½ stepᵀ H step - gᵀ step within low <= step <= high.
Eigen::VectorXd bounded_step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high);

}  // namespace emtb
