#pragma once

#include <span>

#include "analysis/fit/calibrate.h"
#include "analysis/fit/normal_equations.h"

namespace emtb {

/// Standard errors and identifiability at the optimum. Parameters on a bound are left out of the covariance, but that
/// they may lie a little within it is a part of the others' errors.
/// @param result its model holds the fitted values; gets all that is said of them
void judge_optimum(Calibration& result, const FitProblem& problem, std::span<const double> x);

}  // namespace emtb
