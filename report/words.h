#pragma once

#include <string>
#include <vector>

#include "analysis/diagnose/diagnose.h"
#include "model/model.h"

namespace emtb {

/// Parts of sentences that a page has in several places.

std::string value_of(const Parameter& p);        ///< `0.0547 ± 0.0003 N m`
std::string value_in_words(const Parameter& p);  ///< `T_c = 0.0547 +- 0.0003 N m`, in a terminal

/// The values of an effect that were fitted. The phase of a wave that is the only one is not: the angle at which a run
/// starts takes its place.
std::vector<Parameter> fitted_values(const Diagnosis& diagnosis, const MissingEffect& missing);

std::string joined(const std::vector<std::string>& words, const std::string& last = " and ");  ///< `a, b and c`
std::string floors(double error);                                                              ///< `1.02 noise floors`

/// Which runs the errors of a diagnosis are of: `runs that no fit has seen`.
std::string judged_on(const Diagnosis& diagnosis);

/// Which held-out runs were fitted as well, and why: `high.csv, which the training runs do not foretell, was
/// fitted, too, and judges no longer`.
std::string fitted_too_in_words(const Diagnosis& diagnosis);

/// What to do where a bound on the search kept something from being tried.
std::string cut_in_words();

/// Where a noise floor comes from.
std::string source_in_words(const NoiseFloor& noise);

/// From one reading to the next, where it is known: in settled stretches.
std::string autocorrelation_in_words(const NoiseFloor& noise);

}  // namespace emtb
