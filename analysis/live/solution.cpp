#include "analysis/live/solution.h"

#include <algorithm>
#include <cmath>

#include "analysis/numerics/bounded_step.h"
#include "analysis/numerics/linear_algebra.h"

namespace emtb {
namespace {

constexpr int few_seconds = 20;            ///< below which they tell little of their own scatter; by hand
constexpr double least_of_variance = 0.1;  ///< of what the weights claim, whatever the seconds show; by hand

}  // namespace

LiveSolution::LiveSolution(const LiveKnowledge& knowledge)
    : knowledge_(knowledge),
      step_(Eigen::VectorXd::Zero(knowledge.low().size())),
      equations_{knowledge.information(), step_},
      covariance_(step_.size() > 0 ? scaled_inverse(knowledge.information()) : knowledge.information()),
      variance_(covariance_.diagonal()) {}

bool LiveSolution::solve(const SummedPass& pass, std::span<const NoiseColour> colours, const Eigen::VectorXd& at) {
  LiveEquations equations = knowledge_.about(at);
  equations.add(pass.totals(2), colours);
  if (!equations.finite()) return false;
  equations_ = std::move(equations);
  step_ = bounded_step(equations_.h, equations_.g, knowledge_.low() - at, knowledge_.high() - at);
  return true;
}

void LiveSolution::find_errors(const SummedPass& pass, std::span<const NoiseColour> colours) {
  const Eigen::Index n = step_.size();
  covariance_ = scaled_inverse(equations_.h);
  Eigen::MatrixXd scatter = knowledge_.information();  // of what each second says
  int seconds = 0;
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n);
  pass.for_each_second([&](const std::vector<LagSums>& second) {
    LiveEquations of_it = LiveEquations::zero(n);
    of_it.add(second, colours);
    if (of_it.h.trace() <= 0) return;
    ++seconds;
    const Eigen::VectorXd left = solve_normal(one - of_it.h * covariance_, of_it.g - of_it.h * step_);
    if (left.allFinite()) scatter.noalias() += left * left.transpose();
  });
  const Eigen::MatrixXd robust = covariance_ * scatter * covariance_;
  inflation_ = 1;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double white = covariance_(i, i);
    const double least = (seconds < few_seconds ? 1 : least_of_variance) * white;
    variance_[i] = std::max(robust(i, i), least);
    inflation_ = std::max(inflation_, variance_[i] / white);
  }
}

double LiveSolution::distance(Eigen::Index parameters) const {
  const Eigen::MatrixXd uncertain = scaled_inverse(equations_.h).topLeftCorner(parameters, parameters);
  const Eigen::VectorXd step = step_.head(parameters);
  return std::sqrt(std::max(0.0, step.dot(scaled_inverse(uncertain) * step)));
}

}  // namespace emtb
