#include "analysis/numerics/regression.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <string>

#include "analysis/numerics/linear_algebra.h"
#include "hal/error.h"

namespace emtb {

Regression regress(std::span<const std::vector<double>> columns, const std::vector<double>& y,
                   std::span<const double> sigma) {
  const auto rows = static_cast<Eigen::Index>(y.size()), count = static_cast<Eigen::Index>(columns.size());
  if (rows <= count) {
    throw SessionError("a regression on " + std::to_string(count) + " columns needs more than " +
                       std::to_string(count) + " rows, here are " + std::to_string(rows));
  }
  Eigen::MatrixXd a(rows, count);
  for (Eigen::Index c = 0; c < count; ++c) {
    a.col(c) = Eigen::Map<const Eigen::VectorXd>(columns[static_cast<std::size_t>(c)].data(), rows);
  }
  const Eigen::Map<const Eigen::VectorXd> b(y.data(), rows);
  Eigen::VectorXd weight = Eigen::VectorXd::Ones(rows);
  if (!sigma.empty()) weight = Eigen::Map<const Eigen::VectorXd>(sigma.data(), rows).cwiseInverse();
  const Eigen::MatrixXd weighed = weight.asDiagonal() * a;
  const Eigen::VectorXd inverse_size = weighed.colwise().norm().cwiseMax(1e-300).cwiseInverse();
  const Eigen::MatrixXd root = pseudo_inverse(weighed * inverse_size.asDiagonal());
  const Eigen::VectorXd x = inverse_size.asDiagonal() * product(root, weight.cwiseProduct(b));
  const Eigen::VectorXd left = b - a * x;
  const double reduced = weight.cwiseProduct(left).squaredNorm() / static_cast<double>(rows - count);
  const double variance = sigma.empty() ? reduced : std::max(1.0, reduced);
  Regression result;
  for (Eigen::Index c = 0; c < count; ++c) {
    result.value.push_back(x[c]);
    result.std_error.push_back(std::sqrt(variance) * root.row(c).norm() * inverse_size[c]);
  }
  const double spread = (b.array() - b.mean()).matrix().squaredNorm();
  result.r_squared = spread > 0 ? 1 - left.squaredNorm() / spread : 1;
  result.scatter = std::sqrt(left.squaredNorm() / static_cast<double>(rows - count));
  result.rows = y.size();
  return result;
}

}  // namespace emtb
