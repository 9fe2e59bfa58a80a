#include "analysis/fit/descent.h"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/numerics/bounded_step.h"

namespace emtb {
namespace {

using Eigen::VectorXd;

/// A point of a descent, and the cost as a quadratic around it.
struct Point {
  std::vector<double> x;
  NormalEquations around;

  double cost() const { return 0.5 * around.rtr; }
  bool usable() const { return std::isfinite(around.rtr) && around.sts.allFinite() && around.str.allFinite(); }
  /// By how much the quadratic falls over a step.
  double promise(const VectorXd& step) const { return step.dot(around.str) - 0.5 * step.dot(around.sts * step); }
};

Point looked_at(const FitProblem& problem, std::vector<double> x) {
  NormalEquations around = problem.normal_equations(x, true, false);
  return {std::move(x), std::move(around)};
}

/// The lower and upper bounds of the free parameters.
struct Bounds {
  VectorXd low, high;

  explicit Bounds(const FitProblem& problem) : low(static_cast<Eigen::Index>(problem.free().size())), high(low.size()) {
    for (Eigen::Index i = 0; i < low.size(); ++i) {
      const Parameter& p = problem.given().at(problem.free().places()[static_cast<std::size_t>(i)]);
      low[i] = p.min;
      high[i] = p.max;
    }
  }

  /// Of one step: what has a size of its own loses or grows by a factor at most. At a bound that one long step has led
  /// to, the others no longer feel it, and no descent leads back.
  Bounds near(const VectorXd& x) const {
    constexpr double factor = 3;
    Bounds part = *this;
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      if (low[i] <= 0) continue;
      part.low[i] = std::max(low[i], x[i] / factor);
      part.high[i] = std::min(high[i], x[i] * factor);
    }
    return part;
  }

  std::vector<double> within(std::vector<double> x, const VectorXd& step) const {
    for (std::size_t i = 0; i < x.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      x[i] = std::clamp(x[i] + step[row], low[row], high[row]);
    }
    return x;
  }
};

/// The step of a damped quadratic within the bounds. Parameters that differ by five orders of magnitude are scaled to
/// the same curvature, so that the damping is a share of each.
VectorXd damped_step(const Point& here, const Bounds& bounds, double damping) {
  constexpr double regular = 1e-13;  // of the curvature: what nothing tells stays solvable, and where it is
  const VectorXd size = here.around.sts.diagonal().cwiseSqrt().cwiseMax(1e-150);
  const VectorXd inverse = size.cwiseInverse();
  const Eigen::Map<const VectorXd> x(here.x.data(), size.size());
  Eigen::MatrixXd scaled = inverse.asDiagonal() * here.around.sts * inverse.asDiagonal();
  scaled.diagonal().array() += damping + regular;
  const Bounds near = bounds.near(x);
  const VectorXd step = bounded_step(scaled, inverse.cwiseProduct(here.around.str), size.cwiseProduct(near.low - x),
                                     size.cwiseProduct(near.high - x));
  return inverse.cwiseProduct(step);
}

/// How far a quadratic is trusted: the damping of its steps, as a share of the curvature, after Nielsen (1999).
class Trust {
 public:
  double damping() const { return damping_; }
  /// @param kept what a step brought of what it promised
  void good(double kept) {
    damping_ *= std::max(1.0 / 3, 1 - std::pow(2 * kept - 1, 3));
    factor_ = 2;
  }
  void bad() {
    damping_ *= factor_;
    factor_ *= 2;
  }
  bool lost() const { return damping_ > 1e16; }

 private:
  double damping_ = 1e-4, factor_ = 2;
};

/// A descent on its way.
class Way {
 public:
  Way(const FitProblem& problem, std::vector<double> x, double tolerance)
      : problem_(problem), bounds_(problem), tolerance_(tolerance), here_(looked_at(problem, std::move(x))) {}

  const Point& here() const { return here_; }

  /// Tries a step, and takes it where it leads down. @return whether another is worth trying
  bool step() {
    const VectorXd step = damped_step(here_, bounds_, trust_.damping());
    const double promised = here_.promise(step), enough = tolerance_ * here_.cost();
    if (!(promised > 0)) return false;
    Point there = looked_at(problem_, bounds_.within(here_.x, step));
    const double gain = here_.cost() - there.cost();
    if (there.usable() && gain > 0) {
      trust_.good(gain / promised);
      here_ = std::move(there);
      return promised > enough && gain > enough;
    }
    trust_.bad();
    return promised > enough && !trust_.lost();
  }

  /// Where the problem has changed.
  void look_again() { here_ = looked_at(problem_, std::move(here_.x)); }

 private:
  const FitProblem& problem_;
  Bounds bounds_;
  double tolerance_;
  Point here_;
  Trust trust_;
};

}  // namespace

Descent descend(const FitProblem& problem, std::vector<double> x, int max_iterations, double tolerance) {
  constexpr int round_length = 8;  // steps, after which phases that were followed are searched anew
  const double near = std::max(1e-5, 100 * tolerance);  // the phases are followed no nearer than this
  problem.search_phases();
  Way way(problem, std::move(x), tolerance);
  Descent result;
  if (!way.here().usable()) return {way.here().x, infinity, false, 0};  // a load heavier than the whole rotor, say
  double cost_of_round = way.here().cost();
  while (result.iterations < max_iterations && !result.converged) {
    ++result.iterations;
    result.converged = !way.step();
    if (!problem.phases_wander() || (!result.converged && result.iterations % round_length != 0)) continue;
    result.converged = result.converged || way.here().cost() > (1 - near) * cost_of_round;
    cost_of_round = way.here().cost();
    if (result.iterations < max_iterations && problem.finds_better_phases(way.here().x, near)) {
      way.look_again();
      result.converged = false;
    }
  }
  result.x = way.here().x;
  result.cost = way.here().cost();
  return result;
}

}  // namespace emtb
