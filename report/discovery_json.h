#pragma once

#include <nlohmann/json.hpp>
#include <vector>

#include "analysis/discover/discover.h"
#include "analysis/discover/trends.h"

namespace emtb {

/// As the design's section 6 has it, and what came since.
nlohmann::ordered_json to_json(const Discovery& discovery);
nlohmann::ordered_json to_json(const std::vector<Trend>& trends);

}  // namespace emtb
