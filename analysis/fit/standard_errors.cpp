#include "analysis/fit/standard_errors.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>

#include "analysis/fit/at_bound.h"
#include "analysis/fit/typical_size.h"
#include "analysis/numerics/linear_algebra.h"
#include "model/effect.h"

namespace emtb {
namespace {

Identifiability identifiability_of(const NormalEquations& n, const Model& model, const Model& start,
                                   const FreeParameters& free) {
  constexpr double told = 0.3;  // of its size
  // Of the strongest direction: a weaker one is noise of the arithmetic, whatever its singular value.
  constexpr double rounding = 1e-7;
  Identifiability result;
  const std::vector<std::string> names = model.names();
  Eigen::VectorXd size(n.str.size());
  for (Eigen::Index i = 0; i < size.size(); ++i)
    size[i] = typical_size(model, start, free.places()[static_cast<std::size_t>(i)]);
  const Eigen::MatrixXd scaled = size.asDiagonal() * n.sts * size.asDiagonal();
  const Eigensystem eigen = eigensystem(scaled);
  result.singular_values = eigen.values.cwiseMax(0).cwiseSqrt().reverse();
  for (Eigen::Index i = 0; i < size.size(); ++i) {
    const double singular = std::sqrt(std::max(0.0, eigen.values[i]));
    const double error = singular > rounding * result.singular_values[0] ? 1 / singular : infinity;
    if (error < told) continue;
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

/// Writes down which parameters rest on a bound. @return the others that the data see, in the order of the free ones
std::vector<Eigen::Index> split_off_bounds(Calibration& result, const NormalEquations& n, const FreeParameters& free) {
  const std::vector<std::string> names = result.model.names();
  std::vector<Eigen::Index> inner;
  for (Eigen::Index i = 0; i < n.str.size(); ++i) {
    const std::size_t place = free.places()[static_cast<std::size_t>(i)];
    Parameter& parameter = result.model.at(place);
    parameter.std_error.reset();
    if (rests_on_bound(parameter, n.str[i], result.alone[i])) {
      result.at_bound.push_back(names[place]);
    } else if (n.sts(i, i) > 0) {
      inner.push_back(i);
    }
  }
  return inner;
}

/// By how much the scatter of the blocks' gradients exceeds what white residuals would make of it; 0: not seen.
Eigen::VectorXd inflation_of(const NormalEquations& n) {
  Eigen::VectorXd inflation = Eigen::VectorXd::Zero(n.str.size());
  for (Eigen::Index i = 0; i < inflation.size(); ++i) {
    if (!(n.sts(i, i) > 0)) continue;
    inflation[i] = 1;
    for (const std::vector<Block>& blocks : n.blocks) {
      double scatter = 0;
      for (const Block& block : blocks) scatter += block.str[i] * block.str[i];
      inflation[i] = std::max(inflation[i], scatter / n.sts(i, i));
    }
  }
  return inflation;
}

/// (SᵀS)⁻¹, scaled first. A direction that the data do not determine has a huge variance, not none as in a
/// pseudo-inverse.
Eigen::MatrixXd inverse_of(const Eigen::MatrixXd& sts) {
  const Eigen::VectorXd inverse_size = sts.diagonal().cwiseSqrt().cwiseInverse();
  const Eigensystem eigen = eigensystem(inverse_size.asDiagonal() * sts * inverse_size.asDiagonal());
  const double rounding = 1e-13 * eigen.values.maxCoeff();
  const Eigen::VectorXd variances = eigen.values.cwiseMax(rounding).cwiseInverse();
  const Eigen::MatrixXd root = inverse_size.asDiagonal() * eigen.vectors * variances.cwiseSqrt().asDiagonal();
  return product(root, root.transpose());
}

/// Student's 97.5 % quantile over that of a normal distribution: what few blocks add (Cornish and Fisher's expansion).
double few_blocks(double freedom) {
  constexpr double z = 1.96, z2 = z * z;
  return 1 + (z2 + 1) / (4 * freedom) + (5 * z2 * z2 + 16 * z2 + 3) / (96 * freedom * freedom);
}

/// The jackknife's: by how much the optimum moves where a block is left out.
Eigen::MatrixXd jackknife_of(const Eigen::MatrixXd& sts, const std::vector<Block>& blocks,
                             const std::vector<Eigen::Index>& parameters) {
  constexpr double left_out = 0.75;  // of a block: it may be the only one that tells a parameter
  Eigen::MatrixXd variance = Eigen::MatrixXd::Zero(sts.rows(), sts.cols());
  const Eigen::VectorXd scale = sts.diagonal().cwiseSqrt().cwiseInverse();
  for (const Block& block : blocks) {
    const Eigen::MatrixXd others = sts - left_out * block.sts(parameters, parameters);
    const Eigen::MatrixXd scaled = scale.asDiagonal() * others * scale.asDiagonal();
    const Eigen::VectorXd g = scale.asDiagonal() * block.str(parameters);
    const Eigen::VectorXd moved = scale.asDiagonal() * solve_normal(scaled, Eigen::MatrixXd(g));
    variance.noalias() += moved * moved.transpose();
  }
  const double n = static_cast<double>(blocks.size());
  const double factor = n > 1 ? few_blocks(n - 1) : 1;
  return (n - 1) / n * factor * factor * variance;
}

/// The mean square of what a normal distribution leaves beyond a bound, from there, in its variances: its mean lies t
/// standard deviations before the bound.
double mean_square_beyond(double t) {
  constexpr double far = 30;  // where the distribution is hardly left: that of an exponential one
  if (t > far) return 2 / (t * t);
  const double ratio = std::sqrt(2 / std::numbers::pi) * std::exp(-0.5 * t * t) / std::erfc(t / std::numbers::sqrt2);
  return std::max(0.0, 1 + t * t - t * ratio);
}

/// What the others gain in variance because parameters that rest on a bound may as well lie a little within it.
Eigen::MatrixXd by_bounds(const NormalEquations& n, const Eigen::VectorXd& inflation,
                          const std::vector<Eigen::Index>& inner, const Eigen::MatrixXd& inverse) {
  constexpr double told = 1e-9;  // of what a parameter's readings say: else the others say the same
  Eigen::MatrixXd gained = Eigen::MatrixXd::Zero(inverse.rows(), inverse.cols());
  for (Eigen::Index b = 0; b < n.str.size(); ++b) {
    if (!(n.sts(b, b) > 0) || std::ranges::find(inner, b) != inner.end()) continue;
    const Eigen::VectorXd shared = n.sts(inner, std::array{b});
    const Eigen::VectorXd goes_with = product(inverse, Eigen::MatrixXd(shared));
    const double alone = n.sts(b, b) - shared.dot(goes_with);
    if (alone <= told * n.sts(b, b)) continue;
    const double variance = inflation[b] / alone, pull = n.str[b] - goes_with.dot(Eigen::VectorXd(n.str(inner)));
    const double beyond = std::abs(pull) / alone / std::sqrt(variance);
    gained += variance * mean_square_beyond(beyond) * goes_with * goes_with.transpose();
  }
  return gained;
}

}  // namespace

void judge_optimum(Calibration& result, const FitProblem& problem, std::span<const double> x) {
  const FreeParameters& free = problem.free();
  problem.search_phases();
  const NormalEquations n = problem.normal_equations(x, true, true);
  result.alone = n.sts.diagonal().cwiseSqrt().cwiseInverse();
  result.inflation = inflation_of(n);
  result.identifiability = identifiability_of(n, result.model, problem.given(), free);
  result.covariance.setZero(n.str.size(), n.str.size());
  const std::vector<Eigen::Index> inner = split_off_bounds(result, n, free);
  if (inner.empty()) return;
  const Eigen::MatrixXd inverse = inverse_of(n.sts(inner, inner));
  Eigen::MatrixXd together = inverse;
  Eigen::VectorXd variances = inverse.diagonal();
  constexpr std::size_t enough = 6;  // blocks, or their scatter tells nothing
  for (const std::vector<Block>& blocks : n.blocks) {
    const bool shortest = &blocks == &n.blocks.front();
    if (!shortest && problem.quick_errors()) break;
    if (!shortest && blocks.size() < enough) break;
    const Eigen::MatrixXd of_these = jackknife_of(n.sts(inner, inner), blocks, inner);
    if (shortest) together = of_these;
    variances = variances.cwiseMax(of_these.diagonal());
  }
  const Eigen::MatrixXd scatter = (n.sts + n.rounding)(inner, inner);
  const Eigen::MatrixXd rounded = product(product(inverse, scatter), inverse);
  variances = variances.cwiseMax(rounded.diagonal());
  const Eigen::VectorXd off = product(inverse, Eigen::MatrixXd(n.str_of_step(inner)));  // by the steps' length
  const Eigen::MatrixXd gained = by_bounds(n, result.inflation, inner, inverse);
  variances += gained.diagonal();
  result.covariance(inner, inner) = together + gained;
  for (std::size_t k = 0; k < inner.size(); ++k) {
    const auto a = static_cast<Eigen::Index>(k);
    const double variance = variances[a] + off[a] * off[a];
    result.covariance(inner[k], inner[k]) = variance;
    result.inflation[inner[k]] = variance / inverse(a, a);
    Parameter& parameter = result.model.at(free.places()[static_cast<std::size_t>(inner[k])]);
    if (const double error = std::sqrt(variance); error < parameter.max - parameter.min) parameter.std_error = error;
  }
}

}  // namespace emtb
