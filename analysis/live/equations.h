#pragma once

#include <Eigen/Core>
#include <span>

#include "analysis/numerics/lag_sums.h"

namespace emtb {

/// H x = g of a least-squares problem: H is the information about the unknowns x.
struct LiveEquations {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;

  static LiveEquations zero(Eigen::Index unknowns);

  /// Adds what the sums of each output tell. @param colours of the outputs
  void add(std::span<const LagSums> outputs, std::span<const NoiseColour> colours);
  LiveEquations& operator+=(const LiveEquations& other);
  bool finite() const { return h.allFinite() && g.allFinite(); }
};

}  // namespace emtb
