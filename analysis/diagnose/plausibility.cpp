#include "analysis/diagnose/plausibility.h"

#include <cmath>
#include <vector>

#include "analysis/diagnose/null_fit.h"
#include "model/catalogue.h"
#include "model/plausible.h"

namespace emtb {
namespace {

/// What rests on a bound at which it is not absent. (A limit of the driver may be so far off that it is none.)
std::string at_its_bound(const EffectInfo& about, const std::vector<Parameter>& parameters,
                         std::span<const double> values) {
  constexpr double near = 1e-3;  // of the way
  for (std::size_t i = 0; i < about.parameter_count; ++i) {
    const EffectParameter& p = about.parameter_list[i];
    if (p.role != Role::amplitude || parameters[i].fixed) continue;
    const double room = near * (parameters[i].max - parameters[i].min);
    if (p.null != infinity && values[i] >= parameters[i].max - room && p.null < parameters[i].max - room) {
      return Plausible(about, values).at_most(i, std::abs(values[i]), "a bound beyond which it would go");
    }
    if (p.null != infinity && values[i] <= parameters[i].min + room && p.null > parameters[i].min + room) {
      return Plausible(about, values).at_most(i, std::abs(values[i]), "a bound beyond which it would go");
    }
  }
  return {};
}

}  // namespace

FittedMachine machine_of(std::span<const Record> records, const Model& fitted) {
  const std::vector<double> values = fitted.values();
  return {.R_a = values[base::R_a],
          .K_b = values[base::K_b],
          .K_m = values[base::K_m],
          .B = values[base::B],
          .J = values[base::J],
          .current_driven = fitted.input == Signal::i_a,
          .seen = ranges_of(records, without_sensors(fitted))};
}

std::string implausible_value(std::span<const Record> records, const Model& fitted, std::size_t effect) {
  const std::vector<Parameter>& parameters = fitted.parameters_of(effect);
  std::vector<double> values;
  for (const Parameter& p : parameters) values.push_back(p.value);
  if (effect < effect_count) {
    std::string said = implausible(effect, values, machine_of(records, fitted));
    if (!said.empty()) return said;
  }
  return at_its_bound(fitted.about(effect), parameters, values);
}

}  // namespace emtb
