#include "analysis/fit/leave_one_out.h"

#include <cmath>
#include <optional>
#include <utility>

#include "analysis/fit/descent.h"
#include "analysis/fit/normal_equations.h"

namespace emtb {
namespace {

/// Where the records without one lead from the optimum of all; nothing where only a descent tells.
std::optional<std::vector<double>> stepped_without(const FitProblem& problem, std::span<const NormalEquations> each,
                                                   const std::vector<double>& x, std::size_t out) {
  constexpr double short_step = 0.01;  // of the cost: what the quadratic errs by is a fraction of that
  constexpr double kept = 0.9;         // of what a longer one promises
  const NormalEquations others = problem.sum_of(each, x, out);
  if (!others.sts.allFinite() || !others.str.allFinite() || !std::isfinite(others.rtr)) return std::nullopt;
  FirstStep step = first_step(problem, others, x);
  if (!(step.promised > 0)) return x;
  if (step.promised < short_step * 0.5 * others.rtr) return std::move(step.x);
  const NormalEquations there = problem.sum_of(problem.of_each(step.x, false), step.x, out);
  if (!(0.5 * (others.rtr - there.rtr) >= kept * step.promised)) return std::nullopt;
  return std::move(step.x);
}

/// By a descent, without one of the records.
Model fitted_without(std::span<const Record> records, const Fit& of_all, CalibrationOptions options, std::size_t out) {
  std::vector<Record> others(records.begin(), records.end());
  others.erase(others.begin() + static_cast<std::ptrdiff_t>(out));
  if (!options.phases.empty()) options.phases.erase(options.phases.begin() + static_cast<std::ptrdiff_t>(out));
  return calibrate(others, of_all.model, options).model;
}

}  // namespace

std::vector<Model> fits_without_each(std::span<const Record> records, const Fit& of_all, CalibrationOptions options) {
  options.phases = of_all.phases;
  const FitProblem problem(records, of_all.model, options);
  const std::vector<double> x = problem.free().pick({});
  const std::vector<NormalEquations> each = problem.of_each(x, true);
  std::vector<Model> models;
  for (std::size_t out = 0; out < records.size(); ++out) {
    const auto there = stepped_without(problem, each, x, out);
    models.push_back(there ? with_values(of_all.model, problem.free(), *there)
                           : fitted_without(records, of_all, options, out));
  }
  return models;
}

}  // namespace emtb
