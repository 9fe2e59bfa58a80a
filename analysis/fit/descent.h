#pragma once

#include <vector>

#include "analysis/fit/normal_equations.h"

namespace emtb {

/// Where a descent ended.
struct Descent {
  std::vector<double> x;
  double cost = 0;
  bool converged = false;
  int iterations = 0;
};

/// Searches the phases of the rotor and descends by the steps of Levenberg and Marquardt: each is the least of the
/// quadratic that the normal equations are, damped, within the bounds; the damping follows what the last step kept of
/// its promise (Madsen, Nielsen and Tingleff 2004). A step is one simulation of all records with their sensitivities.
/// @param tolerance share of the cost: of less than that no step is tried
Descent descend(const FitProblem& problem, std::vector<double> x, int max_iterations, double tolerance);

}  // namespace emtb
