#pragma once

#include <cmath>
#include <nlohmann/json.hpp>

namespace emtb {

/// NaN has no JSON; null says `nothing`.
inline nlohmann::json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

}  // namespace emtb
