#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "analysis/diagnose/diagnose.h"

namespace emtb {

/// The verdict for the terminal: the word, each effect with its values and rivals, and the next experiment.
std::string verdict_text(const Diagnosis& diagnosis);

/// Why nothing is missing, for a line of its own: what is left is noise, or of no law.
std::string_view nothing_in_words(const Diagnosis& diagnosis);

/// The verdict in a sentence or two, with numbers, for the page.
std::string verdict_in_words(const Diagnosis& diagnosis);

/// A line for each effect that explains something, but not as what it is called: `field_heating would need an
/// implausible value: tau is 0.19 s, ...`.
std::vector<std::string> refused(const Diagnosis& diagnosis);

/// A line for each reason for which effects were not tried: `not tried: torque_lag (no gauge reads the torque)`.
std::vector<std::string> not_tried(const Diagnosis& diagnosis);

}  // namespace emtb
