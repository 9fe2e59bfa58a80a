#pragma once

#include <string>

#include "analysis/diagnose/diagnose.h"

namespace emtb {

/// The verdict for the terminal: the word, each effect with its values and rivals, and the next experiment.
std::string verdict_text(const Diagnosis& diagnosis);

}  // namespace emtb
