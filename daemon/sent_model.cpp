#include "daemon/sent_model.h"

#include <algorithm>
#include <array>

#include "config/formula_effect.h"

namespace emtb {
namespace {

std::size_t parameters_of(const YamlMap& effect) {
  const auto named = effect.map_if("parameters");  // of a formula
  return (named ? *named : effect).keys().size();
}

void refuse_long_formulas(const YamlMap& effect) {
  for (const char* place : {"torque", "voltage", "flux"}) {
    if (effect.text_or(place, "").size() <= SentModel::longest_formula) continue;
    effect.fail(place, "is longer than " + std::to_string(SentModel::longest_formula) + " bytes. Split the formula");
  }
}

}  // namespace

Model read_sent_model(const std::string& text) {
  const YamlMap yaml = YamlMap::parse(text, "model");
  const auto effects = yaml.map_if("effects");
  const auto refuse_more = [&](std::size_t count, std::size_t most, const char* what) {
    if (count <= most) return;
    yaml.fail("effects", "has " + std::to_string(count) + " " + what + ", but a daemon follows at most " +
                             std::to_string(most) + ". Send a smaller model");
  };
  if (effects) {
    const auto names = effects->keys();
    refuse_more(names.size(), SentModel::most_effects, "effects");
    std::size_t formulas = 0, parameters = 0;
    for (const std::string& name : names) {
      const YamlMap effect = effects->map(name);
      parameters += parameters_of(effect);
      if (!is_formula(*effects, name)) continue;
      ++formulas;
      refuse_long_formulas(effect);
    }
    refuse_more(formulas, SentModel::most_formulas, "formulas");
    refuse_more(parameters, SentModel::most_parameters, "parameters");
  }
  return read_model(yaml);
}

}  // namespace emtb
