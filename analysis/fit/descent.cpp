#include "analysis/fit/descent.h"

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

/// The compressed sum of squares as Ceres sees it: p + 1 residuals.
class CompressedCost final : public ceres::CostFunction {
 public:
  explicit CompressedCost(const FitProblem& problem) : problem_(problem) {
    const auto p = static_cast<int>(problem.free().size());
    mutable_parameter_block_sizes()->push_back(p);
    set_num_residuals(p + 1);
  }

  bool Evaluate(double const* const* parameters, double* out, double** jacobians) const override {
    const auto p = static_cast<Eigen::Index>(problem_.free().size());
    const std::span x(parameters[0], static_cast<std::size_t>(p));
    const bool linearize = jacobians != nullptr && jacobians[0] != nullptr;
    const NormalEquations& n = at(x);
    if (!std::isfinite(n.rtr) || !n.sts.allFinite() || !n.str.allFinite()) return false;
    Eigen::Map<Eigen::VectorXd> r(out, p + 1);
    r.setZero();
    if (!linearize) {
      r[p] = std::sqrt(n.rtr);
      return true;
    }
    // SᵀS = L Lᵀ, scaled first: parameters differ by five orders of magnitude. With the Jacobian -Lᵀ, L r = Sᵀ
    // residuals.
    const Eigen::VectorXd size = n.sts.diagonal().cwiseSqrt().cwiseMax(1e-150);
    const Eigen::VectorXd inverse = size.cwiseInverse();
    Eigen::MatrixXd scaled = inverse.asDiagonal() * n.sts * inverse.asDiagonal();
    scaled.diagonal().array() += 1e-13;  // a column of zeros stays solvable
    const Eigen::MatrixXd l = cholesky(scaled);
    const Eigen::VectorXd head = solve_lower(l, inverse.asDiagonal() * n.str);
    r.head(p) = head;
    r[p] = std::sqrt(std::max(0.0, n.rtr - head.squaredNorm()));
    Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>> jacobian(jacobians[0], p + 1, p);
    jacobian.setZero();
    jacobian.topRows(p) = -(l.transpose() * size.asDiagonal());
    return true;
  }

  void forget() { last_x_.clear(); }

  /// Most points that are tried are kept, and then linearized: done at once, that is one simulation instead of two.
  const NormalEquations& at(std::span<const double> x) const {
    if (!std::ranges::equal(x, last_x_)) {
      last_ = problem_.normal_equations(x, true, false);
      last_x_.assign(x.begin(), x.end());
    }
    return last_;
  }

 private:
  const FitProblem& problem_;
  mutable std::vector<double> last_x_;
  mutable NormalEquations last_;
};

}  // namespace

Descent descend(const FitProblem& problem, const Model& model, std::vector<double> x, int max_iterations,
                double tolerance) {
  constexpr int round_length = 8;
  const bool phases_wander = problem.phases_wander();
  problem.search_phases();
  CompressedCost cost(problem);
  const auto places = problem.free().places();
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  options.function_tolerance = tolerance;
  options.parameter_tolerance = tolerance;
  options.logging_type = ceres::SILENT;
  options.num_threads = 1;
  Descent result{std::move(x), 0, false, 0};
  const NormalEquations& start = cost.at(result.x);
  result.cost = 0.5 * start.rtr;
  if (!std::isfinite(start.rtr) || !start.sts.allFinite()) {  // a load heavier than the whole rotor, say
    result.cost = std::numeric_limits<double>::infinity();
    return result;
  }
  std::vector<int> held_before{-1};
  while (result.iterations < max_iterations) {
    std::vector<int> held;
    const Eigen::VectorXd downhill = cost.at(result.x).str;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Parameter& p = model.at(places[i]);
      const double pull = downhill[static_cast<Eigen::Index>(i)];
      if ((result.x[i] <= p.min && pull <= 0) || (result.x[i] >= p.max && pull >= 0))
        held.push_back(static_cast<int>(i));
    }
    if (held.size() == places.size()) result.converged = true;
    if (result.converged && (held == held_before || held.size() == places.size())) break;
    held_before = held;

    ceres::Problem::Options borrow;
    borrow.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ceres::Problem round(borrow);
    round.AddResidualBlock(&cost, nullptr, result.x.data());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Parameter& p = model.at(places[i]);
      round.SetParameterLowerBound(result.x.data(), static_cast<int>(i), p.min);
      round.SetParameterUpperBound(result.x.data(), static_cast<int>(i), p.max);
    }
    if (!held.empty()) {
      round.SetManifold(result.x.data(),
                        new ceres::SubsetManifold(static_cast<int>(places.size()), held));  // NOLINT: Ceres owns it
    }
    options.max_num_iterations = std::min(round_length, max_iterations - result.iterations);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &round, &summary);
    result.cost = summary.final_cost;
    result.converged = summary.termination_type == ceres::CONVERGENCE;
    result.iterations += std::max(1, static_cast<int>(summary.iterations.size()) - 1);
    if (phases_wander) {  // the phases are followed no nearer than this
      const double near = std::max(1e-5, 100 * tolerance);
      result.converged = result.converged || summary.final_cost > (1 - near) * summary.initial_cost;
      if (result.iterations < max_iterations && problem.finds_better_phases(result.x, near)) {
        cost.forget();
        result.converged = false;
      }
    }
    if (summary.termination_type == ceres::FAILURE) break;
  }
  return result;
}

}  // namespace emtb
