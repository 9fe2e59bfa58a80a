#include "analysis/numerics/bounded_step.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {

Eigen::VectorXd bounded_step(const Eigen::MatrixXd& h, const Eigen::VectorXd& g, const Eigen::VectorXd& low,
                             const Eigen::VectorXd& high) {
  const Eigen::Index n = g.size();
  Eigen::VectorXd step = Eigen::VectorXd::Zero(n);
  std::vector<Eigen::Index> inner, held;
  for (Eigen::Index i = 0; i < n; ++i) inner.push_back(i);
  while (!inner.empty()) {
    // What is held at a bound pulls at the others.
    Eigen::VectorXd pull = g(inner);
    if (!held.empty()) pull -= h(inner, held) * step(held);
    const Eigen::MatrixXd covariance = scaled_inverse(h(inner, inner));
    const Eigen::VectorXd part = covariance * pull;
    std::size_t worst = inner.size();
    double most = 0;
    for (std::size_t k = 0; k < inner.size(); ++k) {
      const auto row = static_cast<Eigen::Index>(k);
      const double beyond = std::max(part[row] - high[inner[k]], low[inner[k]] - part[row]);
      const double in_errors = beyond / std::sqrt(covariance(row, row));
      if (beyond > 0 && in_errors > most) {
        most = in_errors;
        worst = k;
      }
      step[inner[k]] = part[row];
    }
    if (worst == inner.size()) break;
    const Eigen::Index i = inner[worst];
    step[i] = std::clamp(step[i], low[i], high[i]);
    held.push_back(i);
    inner.erase(inner.begin() + static_cast<std::ptrdiff_t>(worst));
  }
  return step.cwiseMax(low).cwiseMin(high);
}

}  // namespace emtb
