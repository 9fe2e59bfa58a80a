#pragma once

#include <filesystem>
#include <string>

#include "config/model.h"
#include "model/catalogue.h"

namespace emtb {

/// The paper's linear model, and others made of it.
inline Model linear_model() { return read_model(std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml"); }

/// With an effect of usual size, and what it needs.
inline Model with(Model model, const std::string& id) {
  const std::size_t effect = effect_index(id);
  const EffectInfo& info = effect_catalogue()[effect];
  if (!info.needs.empty()) model = with(std::move(model), std::string(info.needs));
  model.include(effect);
  for (std::size_t i = 0; i < info.parameter_count; ++i) {
    model.parameters_of(effect)[i].value = info.parameters()[i].typical;
  }
  return model;
}

}  // namespace emtb
