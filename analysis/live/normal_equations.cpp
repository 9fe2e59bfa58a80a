#include "analysis/live/normal_equations.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {

NormalEquations NormalEquations::zero(Eigen::Index unknowns) {
  return {Eigen::MatrixXd::Zero(unknowns, unknowns), Eigen::VectorXd::Zero(unknowns)};
}

void NormalEquations::add(std::span<const LagSums> outputs, std::span<const Colour> colours) {
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    if (outputs[o].blocks() > 0) outputs[o].weigh_into(h, g, colours[o]);
  }
}

NormalEquations& NormalEquations::operator+=(const NormalEquations& other) {
  h += other.h;
  g += other.g;
  return *this;
}

Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& a) {
  const Eigen::VectorXd size = a.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigensystem eigen = eigensystem(size.asDiagonal() * a * size.asDiagonal());
  const double rounding = 1e-14 * eigen.values.maxCoeff();
  const Eigen::MatrixXd root =
      size.asDiagonal() * eigen.vectors * eigen.values.cwiseMax(rounding).cwiseSqrt().cwiseInverse().asDiagonal();
  return product(root, root.transpose());
}

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
    const Eigen::MatrixXd covariance = inverse_of(h(inner, inner));
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
