#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/check/finding.h"

namespace emtb {

/// One line a finding: where, which signal, what, and what to do. What is said alike of several runs is one line.
std::vector<std::string> lines_of(const DataFindings& findings);

/// Where a finding stops a fit: what contradicts the recordings, they themselves or the model's bounds, and what to do.
std::string why_nothing_is_fitted(const DataFindings& findings);

/// {"findings": [{"session", "run", "signal", "what", "from_s", "to_s", "text", "stops"}]}; null where a finding is of
/// all runs, or of no signal.
nlohmann::ordered_json to_json(const DataFindings& findings);

}  // namespace emtb
