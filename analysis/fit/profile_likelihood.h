#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <string>

#include "analysis/fit/calibrate.h"

namespace emtb {

/// The values of a parameter that the data do not speak against.
struct LikelihoodInterval {
  double low = 0, high = 0;
  bool low_at_bound = false;   ///< the data would allow even less than the parameter's bound, which is `low`
  bool high_at_bound = false;  ///< and more
};

/// The 95 % interval of one parameter by profile likelihood: held at a value, with all others calibrated anew, until
/// the data speak against it (Venzon and Moolgavkar 1988; Raue et al. 2009). A standard error stands for the curvature
/// at the optimum and thus for a symmetric interval; this one is right where a parameter lies at its bound, or acts by
/// its square, or where a large change of it can be made good by the others.
///
/// Coloured residuals count as in the standard errors: the rise of the cost that is still allowed, half the
/// chi-square's 95 % quantile of one degree of freedom where they are white, grows with Calibration::inflation.
/// @param fitted what calibrate() made of these records
/// @param place of the parameter in the structure
/// @return nothing where the parameter is fixed or tied, or moves nothing that was measured
std::optional<LikelihoodInterval> profile_likelihood(std::span<const Record> records, const Calibration& fitted,
                                                     std::size_t place, const CalibrationOptions& options = {});

/// Those of all parameters of a calibration, by their names.
using LikelihoodIntervals = std::map<std::string, LikelihoodInterval>;
LikelihoodIntervals profile_likelihoods(std::span<const Record> records, const Calibration& fitted,
                                        const CalibrationOptions& options = {});

/// Whether the interval of value +- 1.96 standard errors says something else: an end off by more than a quarter of its
/// width.
bool misled(const Parameter& parameter, const LikelihoodInterval& interval);

}  // namespace emtb
