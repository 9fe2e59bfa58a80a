#pragma once

#include <vector>

#include "analysis/fit/normal_equations.h"
#include "model/model.h"

namespace emtb {

/// Where a descent ended.
struct Descent {
  std::vector<double> x;
  double cost = 0;
  bool converged = false;
  int iterations = 0;
};

/// Descends in rounds of a few iterations. A parameter that rests on a bound and would leave it stays there for a
/// round: otherwise every step would be cut short at that bound, and the others would creep.
Descent descend(const FitProblem& problem, const Model& model, std::vector<double> x, int max_iterations,
                double tolerance);

}  // namespace emtb
