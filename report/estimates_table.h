#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace emtb {

/// The live estimates as a person reads them: a line a parameter, then how far each signal is from the model.
std::string estimates_table(const nlohmann::json& estimates);

}  // namespace emtb
