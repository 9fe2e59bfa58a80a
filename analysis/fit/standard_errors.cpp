#include "analysis/fit/standard_errors.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

/// The size by which a change of a parameter is called large: its own value, or where that is nothing, a part of its
/// range.
double size_of(const Parameter& p) { return std::max(std::abs(p.value), 1e-3 * (p.max - p.min)); }

Identifiability identifiability_of(const NormalEquations& n, const Model& model, const FreeParameters& free) {
  Identifiability result;
  const std::vector<std::string> names = model.names();
  Eigen::VectorXd size(n.str.size());
  for (Eigen::Index i = 0; i < size.size(); ++i)
    size[i] = size_of(model.at(free.places()[static_cast<std::size_t>(i)]));
  const Eigen::MatrixXd scaled = size.asDiagonal() * n.sts * size.asDiagonal();
  const Eigensystem eigen = eigensystem(scaled);
  result.singular_values = eigen.values.cwiseMax(0).cwiseSqrt().reverse();
  for (Eigen::Index i = 0; i < size.size(); ++i) {
    const double singular = std::sqrt(std::max(0.0, eigen.values[i]));
    const double error = singular > 0 ? 1 / singular : std::numeric_limits<double>::infinity();
    // Also what is lost in rounding: a direction 10^7 times weaker than the strongest is noise of the arithmetic.
    if (error < 0.3 && singular > 1e-7 * result.singular_values[0]) continue;
    const Eigen::VectorXd direction = eigen.vectors.col(i);
    std::string words;
    for (Eigen::Index j = 0; j < size.size(); ++j) {
      if (std::abs(direction[j]) < 0.1) continue;
      char text[32];
      std::snprintf(text, sizeof text, "%+.2f ",
                    direction[j] * (direction.cwiseAbs().maxCoeff() == -direction.minCoeff() ? -1 : 1));
      words += (words.empty() ? "" : " ") + std::string(text) + names[free.places()[static_cast<std::size_t>(j)]];
    }
    result.undetermined.push_back({words, error});
  }
  return result;
}

}  // namespace

void judge_optimum(Calibration& result, const FitProblem& problem, std::span<const double> x) {
  const FreeParameters& free = problem.free();
  problem.search_phases();
  const NormalEquations n = problem.normal_equations(x, true, true);
  const std::vector<std::string> names = result.model.names();
  const auto p = static_cast<Eigen::Index>(free.size());
  std::vector<Eigen::Index> inner;
  for (Eigen::Index i = 0; i < p; ++i) {
    const std::size_t place = free.places()[static_cast<std::size_t>(i)];
    Parameter& parameter = result.model.at(place);
    // Bounds of effects are far wider than any value: only the bound itself counts.
    const bool on_bound = parameter.value <= parameter.min + 1e-9 * std::abs(parameter.min) ||
                          parameter.value >= parameter.max - 1e-9 * std::abs(parameter.max);
    parameter.std_error.reset();
    if (on_bound) {
      result.at_bound.push_back(names[place]);
    } else if (n.sts(i, i) > 0) {
      inner.push_back(i);
    }
  }
  result.covariance.setZero(p, p);
  result.alone = n.sts.diagonal().cwiseSqrt().cwiseInverse();
  result.inflation.setZero(p);
  for (Eigen::Index i = 0; i < p; ++i) {
    if (!(n.sts(i, i) > 0)) continue;
    result.inflation[i] = 1;
    for (const auto& gradients : n.block_gradients) {
      double scatter = 0;
      for (const Eigen::VectorXd& g : gradients) scatter += g[i] * g[i];
      result.inflation[i] = std::max(result.inflation[i], scatter / n.sts(i, i));
    }
  }
  result.identifiability = identifiability_of(n, result.model, free);
  if (inner.empty()) return;
  const Eigen::MatrixXd sts = n.sts(inner, inner);
  const Eigen::VectorXd inverse_size = sts.diagonal().cwiseSqrt().cwiseInverse();
  // A direction that the data do not determine has a huge variance, not none as in a pseudo-inverse.
  const Eigensystem eigen = eigensystem(inverse_size.asDiagonal() * sts * inverse_size.asDiagonal());
  const double rounding = 1e-13 * eigen.values.maxCoeff();
  const Eigen::VectorXd variances = eigen.values.cwiseMax(rounding).cwiseInverse();
  const Eigen::MatrixXd root = inverse_size.asDiagonal() * eigen.vectors * variances.cwiseSqrt().asDiagonal();
  const Eigen::MatrixXd inverse = product(root, root.transpose());
  const auto sandwich_of = [&](const std::vector<Eigen::VectorXd>& gradients) -> Eigen::MatrixXd {
    Eigen::MatrixXd meat = Eigen::MatrixXd::Zero(sts.rows(), sts.cols());
    for (const Eigen::VectorXd& g : gradients) {
      const Eigen::VectorXd part = g(inner);
      meat.noalias() += part * part.transpose();
    }
    const double blocks = static_cast<double>(gradients.size());
    meat *= blocks / std::max(1.0, blocks - static_cast<double>(inner.size()));
    return product(product(inverse, meat), inverse);
  };
  constexpr double enough = 10;  // blocks more than parameters, or their scatter tells nothing
  const auto& [of_one, of_five] = n.block_gradients;
  const bool long_ones_tell =
      !problem.quick_errors() && static_cast<double>(of_five.size()) >= enough + static_cast<double>(inner.size());
  const Eigen::MatrixXd sandwich = sandwich_of(of_one), of_long = long_ones_tell ? sandwich_of(of_five) : sandwich;
  const Eigen::VectorXd off = product(inverse, Eigen::MatrixXd(n.str_of_step(inner)));  // by the steps' length
  for (std::size_t a = 0; a < inner.size(); ++a) {
    for (std::size_t b = 0; b < inner.size(); ++b) {
      const auto ia = static_cast<Eigen::Index>(a), ib = static_cast<Eigen::Index>(b);
      result.covariance(inner[a], inner[b]) = sandwich(ia, ib);
    }
    const auto ia = static_cast<Eigen::Index>(a);
    const double variance = std::max({sandwich(ia, ia), of_long(ia, ia), inverse(ia, ia)}) + off[ia] * off[ia];
    result.covariance(inner[a], inner[a]) = variance;
    result.inflation[inner[a]] = variance / inverse(ia, ia);
    Parameter& parameter = result.model.at(free.places()[static_cast<std::size_t>(inner[a])]);
    if (const double error = std::sqrt(variance); error < parameter.max - parameter.min) parameter.std_error = error;
  }
}

}  // namespace emtb
