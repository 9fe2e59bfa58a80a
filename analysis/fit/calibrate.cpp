#include "analysis/fit/calibrate.h"

#include <ceres/ceres.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "analysis/fit/turn.h"
#include "analysis/numerics/linear_algebra.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

bool wanted(Signal signal, const CalibrationOptions& options) {
  return options.outputs.empty() || std::ranges::find(options.outputs, signal) != options.outputs.end();
}

/// The normal equations of one model on all records: SᵀS, Sᵀr, rᵀr, and for judging what they say the gradient of each
/// block, and by how much Sᵀr would change were the simulation exact.
struct NormalEquations {
  Eigen::MatrixXd sts;
  Eigen::VectorXd str;
  double rtr = 0;
  std::array<std::vector<Eigen::VectorXd>, 2> block_gradients;  ///< of short and of long blocks
  Eigen::VectorXd str_of_step;
};

/// The record, to be simulated in steps of half the length.
PreparedRun in_half_steps(const PreparedRun& record) {
  PreparedRun fine = record;
  Excitation& x = fine.excitation;
  const double interval = (x.t.back() - x.t.front()) / static_cast<double>(std::max<std::size_t>(2, x.t.size()) - 1);
  x.longest_step = 0.5 * std::min(interval, x.longest_step);
  x.quick_step = 0.5 * std::min(interval, x.quick_step);
  return fine;
}

class Problem {
 public:
  Problem(std::span<const PreparedRun> records, const Model& model, const CalibrationOptions& options)
      : records_(records), model_(model), options_(options), free_(model), moved_(moved_by(free_)) {
    for (const std::size_t place : free_.places()) {
      const Parameter& p = model.at(place);
      if (p.prior) priors_.push_back({prior_column(place), *p.prior});
    }
  }

  const FreeParameters& free() const { return free_; }
  bool quick_errors() const { return options_.quick_errors; }

  /// Where in a turn the records start is searched anew, in all of the turn, unless it is given; else it is followed
  /// from one call to the next.
  void search_turns() const {
    turns_ = options_.turns;
    least_ = std::numeric_limits<double>::infinity();
  }

  /// Whether the turns change in the course of a record.
  bool turns_wander() const {
    return model_.periodic() && std::ranges::any_of(records_, [](const PreparedRun& r) { return r.angle_wander > 0; });
  }

  /// As far as they have been followed.
  const Turns& turns() const { return turns_; }

  /// Searches the turns anew where they have been followed to. @return whether that lowers the cost by a share
  bool finds_better_turns(std::span<const double> x, double share) const {
    if (!options_.turns.empty()) return false;
    const Turns followed = turns_;
    const double before = least_;
    search_turns();
    if (normal_equations(x, false, false).rtr < (1 - share) * before) return true;
    turns_ = followed;
    least_ = before;
    return false;
  }

  /// @param to_judge with what tells how good an optimum is
  NormalEquations normal_equations(std::span<const double> x, bool with_sensitivities, bool to_judge) const {
    const bool in_steps = to_judge && !options_.quick_errors;
    const auto p = static_cast<Eigen::Index>(free_.size());
    const std::vector<double> values = free_.spread(x);
    std::vector<NormalEquations> each(records_.size());
    Turns turns(records_.size());
    const auto one = [&](std::size_t i) {
      const auto moved = with_sensitivities ? std::span(moved_) : std::span<const std::vector<std::size_t>>{};
      NormalEquations& n = each[i];
      n.sts.setZero(p, p);
      n.str.setZero(p);
      n.str_of_step.setZero(p);
      std::map<long, Eigen::VectorXd> blocks;
      const ModelStructure structure = records_[i].structure(model_);
      turns[i] = best_turn(records_[i], structure, values, turns_.empty() ? nullptr : &turns_[i]);
      n.rtr += turns[i].unlikely;
      std::vector<Residuals> finer;
      if (in_steps) finer = residuals_at_turn(in_half_steps(records_[i]), structure, values, {}, turns[i]).residuals;
      const auto [all, prior] = residuals_at_turn(records_[i], structure, values, moved, turns[i]);
      if (prior.sts.size() > 0) {
        n.sts += prior.sts;
        n.str += prior.str;
      }
      for (std::size_t s = 0; s < all.size(); ++s) {
        const Residuals& r = all[s];
        if (!wanted(r.signal, options_)) continue;
        n.rtr += r.value.squaredNorm();
        if (!r.informed()) continue;
        n.sts += gram(r.sensitivity);
        n.str += transposed_product(r.sensitivity, r.value);
        if (!to_judge) continue;
        add_blocks(records_[i], r, blocks);
        if (!in_steps) continue;
        constexpr double second_order = 4.0 / 3;  // half steps show three quarters of the error
        n.str_of_step += second_order * transposed_product(r.sensitivity, finer[s].value - r.value);
      }
      long last = -1;
      for (const auto& [second, gradient] : blocks) {
        auto& [of_one, of_five] = n.block_gradients;
        of_one.push_back(gradient);
        if (of_five.empty() || second / 5 != last) {
          of_five.push_back(gradient);
        } else {
          of_five.back() += gradient;
        }
        last = second / 5;
      }
    };
    parallel_for(records_.size(), one, [&](std::size_t i) { return records_[i].length(); });
    NormalEquations sum{Eigen::MatrixXd::Zero(p, p), Eigen::VectorXd::Zero(p), 0, {}, Eigen::VectorXd::Zero(p)};
    for (NormalEquations& n : each) {
      sum.sts += n.sts;
      sum.str += n.str;
      sum.str_of_step += n.str_of_step;
      sum.rtr += n.rtr;
      for (std::size_t b = 0; b < n.block_gradients.size(); ++b) {
        std::ranges::move(n.block_gradients[b], std::back_inserter(sum.block_gradients[b]));
      }
    }
    for (const auto& [column, prior] : priors_) {
      const double r = (prior.value - x[static_cast<std::size_t>(column)]) / prior.std;
      sum.sts(column, column) += 1 / (prior.std * prior.std);
      sum.str[column] += r / prior.std;
      sum.rtr += r * r;
    }
    if (sum.rtr <= least_) {  // a step that was too long may have left the valley: it is not followed
      least_ = sum.rtr;
      turns_ = std::move(turns);
    }
    return sum;
  }

 private:
  Eigen::Index prior_column(std::size_t place) const { return static_cast<Eigen::Index>(*free_.mover(place)); }

  static void add_blocks(const PreparedRun& record, const Residuals& r, std::map<long, Eigen::VectorXd>& blocks) {
    for_each_second(record, r, [&](long second, Eigen::Index begin, Eigen::Index rows) {
      const Eigen::VectorXd g = transposed_product(r.sensitivity.middleRows(begin, rows), r.value.segment(begin, rows));
      auto& sum = blocks[second];
      if (sum.size() == 0) sum.setZero(g.size());
      sum += g;
    });
  }

  std::span<const PreparedRun> records_;
  const Model& model_;
  const CalibrationOptions& options_;
  FreeParameters free_;
  std::vector<std::vector<std::size_t>> moved_;
  std::vector<std::pair<Eigen::Index, Prior>> priors_;
  mutable Turns turns_;  // of each record, where the cost was least; empty: to be searched
  mutable double least_ = std::numeric_limits<double>::infinity();
};

/// The compressed sum of squares as Ceres sees it: p + 1 residuals.
class CompressedCost final : public ceres::CostFunction {
 public:
  explicit CompressedCost(const Problem& problem) : problem_(problem) {
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
  const Problem& problem_;
  mutable std::vector<double> last_x_;
  mutable NormalEquations last_;
};

struct Descent {
  std::vector<double> x;
  double cost = 0;
  bool converged = false;
  int iterations = 0;
};

/// Descends in rounds of a few iterations. A parameter that rests on a bound and would leave it stays there for a
/// round: otherwise every step would be cut short at that bound, and the others would creep.
Descent descend(const Problem& problem, const Model& model, std::vector<double> x, int max_iterations,
                double tolerance) {
  constexpr int round_length = 8;
  const bool turns_wander = problem.turns_wander();
  problem.search_turns();
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
    if (turns_wander) {  // the turns are followed no nearer than this
      const double near = std::max(1e-5, 100 * tolerance);
      result.converged = result.converged || summary.final_cost > (1 - near) * summary.initial_cost;
      if (result.iterations < max_iterations && problem.finds_better_turns(result.x, near)) {
        cost.forget();
        result.converged = false;
      }
    }
    if (summary.termination_type == ceres::FAILURE) break;
  }
  return result;
}

/// A number in [0, 1) that looks drawn by lot and is the same everywhere: the additive recurrence of the golden ratio.
double lot(std::size_t start, std::size_t dimension) {
  const double irrational = std::sqrt(static_cast<double>(dimension) * 2 + 5);
  const double x = static_cast<double>(start + 1) * (irrational - std::floor(irrational)) + 0.5;
  return x - std::floor(x);
}

std::vector<double> other_start(const Problem& problem, const Model& model, std::size_t start) {
  std::vector<double> x;
  const auto places = problem.free().places();
  for (std::size_t i = 0; i < places.size(); ++i) {
    const Parameter& p = model.at(places[i]);
    if (places[i] >= ModelStructure::base_count) {
      x.push_back(p.value);  // bounds of effects are those of physics, far wider than any guess
      continue;
    }
    const double u = lot(start, i);
    // Sizes are guessed within a factor, so bounds of one sign are divided by ratio.
    x.push_back(p.min > 0 ? p.min * std::pow(p.max / p.min, u) : p.min + (p.max - p.min) * u * u);
  }
  return x;
}

/// Does another point lie in the valley of an optimum? It does where the cost there is what the optimum's curvature
/// foretells. A descent from it would only come back.
bool same_valley(const NormalEquations& at_optimum, const Descent& optimum, std::span<const double> x, double cost) {
  const Eigen::Map<const Eigen::VectorXd> from(optimum.x.data(), static_cast<Eigen::Index>(x.size()));
  const Eigen::VectorXd way = Eigen::Map<const Eigen::VectorXd>(x.data(), from.size()) - from;
  const double rise = 0.5 * way.dot(at_optimum.sts * way) - way.dot(at_optimum.str);
  return cost > optimum.cost && std::abs(cost - optimum.cost - rise) < 0.5 * rise;
}

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

/// Standard errors and identifiability at the optimum; parameters on a bound are left out of the covariance.
void judge(Calibration& result, const Problem& problem, std::span<const double> x) {
  const FreeParameters& free = problem.free();
  problem.search_turns();
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

}  // namespace

std::vector<PreparedRun> shortest_records(std::span<const PreparedRun> records) {
  std::vector<PreparedRun> part(records.begin(), records.end());
  std::ranges::stable_sort(part, {}, [](const PreparedRun& r) { return r.length(); });
  std::size_t total = 0, taken = 0, keep = 0;
  for (const PreparedRun& r : part) total += r.length();
  while (keep < part.size() && (keep < 2 || 4 * (taken + part[keep].length()) <= total)) {
    taken += part[keep++].length();
  }
  part.resize(keep);
  return part;
}

Calibration calibrate(std::span<const PreparedRun> records, const Model& model, const CalibrationOptions& options) {
  const Problem problem(records, model, options);
  const FreeParameters& free = problem.free();
  Calibration result;
  result.model = model;
  if (free.size() == 0) {
    result.cost = 0.5 * problem.normal_equations({}, false, false).rtr;
    result.converged = true;
    return result;
  }
  const std::vector<double> given = free.pick({});
  if (!std::isfinite(problem.normal_equations(given, false, false).rtr)) {
    throw ModelError("model `" + model.name + "` cannot be simulated with its start values: the result is not finite");
  }
  Descent best = descend(problem, model, given, options.max_iterations, options.tolerance);
  // Other starts descend on a part of the data; what they reach is tried on all of it.
  const std::vector<PreparedRun> part =
      options.extra_starts > 0 ? shortest_records(records) : std::vector<PreparedRun>{};
  const Problem glance(part, model, options);
  NormalEquations at_best;
  if (options.extra_starts > 0) at_best = problem.normal_equations(best.x, true, false);  // at the turns of its descent
  for (int s = 0; s < options.extra_starts; ++s) {
    const Descent rough = descend(glance, model, other_start(problem, model, static_cast<std::size_t>(s)), 15, 1e-6);
    problem.search_turns();
    const double cost = 0.5 * problem.normal_equations(rough.x, false, false).rtr;
    if (!(cost < 2 * best.cost) || same_valley(at_best, best, rough.x, cost)) continue;
    Descent other = descend(problem, model, rough.x, options.max_iterations, options.tolerance);
    if (other.cost >= best.cost * (1 - 1e-9)) continue;
    best = std::move(other);
    at_best = problem.normal_equations(best.x, true, false);
  }
  const std::vector<double> all = free.spread(best.x);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (free.mover(i) || !result.model.at(i).fixed) result.model.at(i).value = all[i];
  }
  result.cost = best.cost;
  result.converged = best.converged;
  result.iterations = best.iterations;
  if (options.extra_starts == 0) result.turns = problem.turns();
  if (options.with_covariance) judge(result, problem, best.x);
  return result;
}

}  // namespace emtb
