#pragma once

#include <Eigen/Core>

namespace emtb {

/// The step that minimizes ½ stepᵀ H step - gᵀ step within low <= step <= high.
Eigen::VectorXd bounded_step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high);

}  // namespace emtb
