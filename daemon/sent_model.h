#pragma once

#include <string>

#include "config/model.h"

namespace emtb {

/// A model that a client sends: within bounds, so that reading it, and a step of it, keeps nobody waiting.
struct SentModel {
  static constexpr std::size_t most_effects = 40;       ///< the whole library, about
  static constexpr std::size_t most_formulas = 8;       ///< effects that are no effect of the library
  static constexpr std::size_t most_parameters = 96;    ///< of all effects together
  static constexpr std::size_t longest_formula = 1000;  // [byte]
};

/// @throws ConfigError where it is no model, or beyond those bounds
Model read_sent_model(const std::string& text);

}  // namespace emtb
