#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "model/simulation.h"
#include "model/structure.h"

namespace emtb {

/// A parameter whose sensitivities are checked.
struct CheckedParameter {
  std::string name;
  double value = 0;
  double size = 0;  ///< a typical size: differences are taken over a small part of it
  double min = 0, max = 0;
};

/// A simulation whose sensitivities are checked.
struct SensitivityCase {
  ModelStructure structure;
  std::vector<CheckedParameter> parameters;  ///< all, in the order of the structure
  Excitation excitation;
};

/// d(signal)/d(parameter) over time, for each parameter.
using Sensitivities = std::vector<Trajectory<double>>;

/// What the model says.
Sensitivities model_sensitivities(const SensitivityCase& c);

/// What differences of simulations without derivatives say: central ones, one-sided at a bound, of second order, the
/// step halved once and extrapolated (Ridders), so that their own error is far below the tolerance of the check.
Sensitivities difference_sensitivities(const SensitivityCase& c);

/// Do they agree at every time, for every signal and parameter, within `tolerance` of the signal's largest sensitivity?
testing::AssertionResult agree(const SensitivityCase& c, const Sensitivities& model, const Sensitivities& differences,
                               double tolerance);

/// The one check of all sensitivities: model against differences.
///
/// Wrong derivatives are never nearly right: a forgotten term of 10^-5 fails. Where a parameter hardly moves a signal,
/// the rounding of the differences themselves is allowed for.
testing::AssertionResult CheckSensitivities(const SensitivityCase& c, double tolerance = 1e-5);

}  // namespace emtb
