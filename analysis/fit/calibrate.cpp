#include "analysis/fit/calibrate.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/fit/descent.h"
#include "analysis/fit/normal_equations.h"
#include "analysis/fit/standard_errors.h"
#include "analysis/numerics/parallel.h"
#include "hal/error.h"
#include "model/effect.h"

namespace emtb {
namespace {

/// A number in [0, 1) that looks drawn by lot and is the same everywhere: the additive recurrence of the golden ratio.
double lot(std::size_t start, std::size_t dimension) {
  const double irrational = std::sqrt(static_cast<double>(dimension) * 2 + 5);
  const double x = static_cast<double>(start + 1) * (irrational - std::floor(irrational)) + 0.5;
  return x - std::floor(x);
}

std::vector<double> other_start(const FitProblem& problem, const Model& model, std::size_t start) {
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

/// The descent from what is given, and those from other starts: on a part of the data, what they reach is to be tried
/// on all of it.
struct FirstDescents {
  Descent from_given;
  std::vector<Descent> rough;
};

FirstDescents first_descents(const FitProblem& problem, std::span<const Record> records, const Model& model,
                             const CalibrationOptions& options) {
  FirstDescents d;
  d.rough.resize(static_cast<std::size_t>(std::max(0, options.extra_starts)));
  const ShortestRecords part(d.rough.empty() ? std::span<const Record>{} : records);
  const auto descent = [&](std::size_t i) {
    if (i == 0) {
      d.from_given = descend(problem, problem.free().pick({}), options.max_iterations, options.tolerance);
    } else {
      const FitProblem first_look(part.all(), model, options);
      d.rough[i - 1] = descend(first_look, other_start(problem, model, i - 1), 15, 1e-6);
    }
  };
  if (records.size() == 1) {  // a run has one core: the descents share them out
    each_on_a_core(1 + d.rough.size(), descent);
  } else {
    for (std::size_t i = 0; i <= d.rough.size(); ++i) descent(i);
  }
  return d;
}

}  // namespace

ShortestRecords::ShortestRecords(std::span<const Record> records) : part_(records) {
  constexpr std::size_t few = 2;
  if (records.size() <= few) return;
  std::vector<std::size_t> shortest_first(records.size());
  std::iota(shortest_first.begin(), shortest_first.end(), std::size_t{0});
  std::size_t total = 0;
  for (const Record& r : records) total += r.length();
  std::ranges::stable_sort(shortest_first, {}, [&](std::size_t place) { return records[place].length(); });
  std::size_t taken = 0;
  for (const std::size_t place : shortest_first) {
    taken += records[place].length();
    if (copies_.size() >= few && 4 * taken > total) break;
    copies_.push_back(records[place]);
    places_.push_back(place);
  }
  part_ = copies_;
}

RotorPhases ShortestRecords::of(const RotorPhases& known) const {
  if (known.empty() || copies_.empty()) return known;
  RotorPhases phases;
  for (const std::size_t place : places_) phases.push_back(known[place]);
  return phases;
}

Calibration calibrate(std::span<const Record> records, const Model& model, const CalibrationOptions& options) {
  const FitProblem problem(records, model, options);
  const FreeParameters& free = problem.free();
  Calibration result;
  if (free.size() == 0) {
    result.model = model;
    result.cost = 0.5 * problem.normal_equations({}, false, false).rtr;
    result.converged = true;
    return result;
  }
  const std::vector<double> given = free.pick({});
  auto [best, rough] = first_descents(problem, records, model, options);
  const auto can_be_simulated = [&](std::span<const double> x) {
    return std::isfinite(problem.normal_equations(x, false, false).rtr);
  };
  // A start may be one that no machine has (a part of J above J); another within the bounds is not.
  constexpr std::size_t most_other_starts = 16;
  const bool may_begin_elsewhere = options.extra_starts > 0 && best.cost == infinity &&
                                   std::ranges::all_of(given, [](double x) { return std::isfinite(x); }) &&
                                   !can_be_simulated(given);
  for (std::size_t s = 0; may_begin_elsewhere && best.cost == infinity && s < most_other_starts; ++s) {
    const std::vector<double> start = other_start(problem, model, s);
    if (can_be_simulated(start)) best = descend(problem, start, options.max_iterations, options.tolerance);
  }
  if (best.cost == infinity && !can_be_simulated(given)) {
    throw ModelError("model `" + model.name + "` cannot be simulated with its start values: the result is not finite");
  }
  NormalEquations at_best;
  if (options.extra_starts > 0)
    at_best = problem.normal_equations(best.x, true, false);  // at the phases of its descent
  constexpr double clearly = 1e-4;  // better; of two valleys alike, that of what was given stands
  for (const Descent& there : rough) {
    problem.search_phases();
    const double cost = 0.5 * problem.normal_equations(there.x, false, false).rtr;
    if (!(cost < 2 * best.cost) || same_valley(at_best, best, there.x, cost)) continue;
    Descent other = descend(problem, there.x, options.max_iterations, options.tolerance);
    if (other.cost >= best.cost * (1 - clearly)) continue;
    best = std::move(other);
    at_best = problem.normal_equations(best.x, true, false);
  }
  result.model = with_values(model, free, best.x);
  result.cost = best.cost;
  result.converged = best.converged;
  result.iterations = best.iterations;
  if (options.extra_starts == 0) result.phases = problem.phases();
  if (options.with_covariance) judge_optimum(result, problem, best.x);
  return result;
}

Fit fit_or_none(std::span<const Record> records, const Model& start, CalibrationOptions options) {
  try {
    return calibrate(records, start, options);
  } catch (const ModelError&) {
    return {.model = start, .cost = infinity};
  }
}

}  // namespace emtb
