#include "config/formula_effect.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <memory>
#include <optional>

#include "config/formula.h"
#include "config/parameter.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "model/machine/memory.h"

namespace emtb {
namespace {

struct PlaceKey {
  TermPlace place;
  const char* key;
  const char* equation;  ///< what stands before the formula
  Stage stage;
};
constexpr std::array<PlaceKey, 3> place_keys{{{TermPlace::torque, "torque", "T = ", Stage::shaft},
                                              {TermPlace::voltage, "voltage", "V = ", Stage::armature},
                                              {TermPlace::flux, "flux", "K_b and K_m times ", Stage::air_gap}}};

const PlaceKey& described(TermPlace place) { return *std::ranges::find(place_keys, place, &PlaceKey::place); }

bool is_word(std::string_view name) {
  const auto letter = [](char c) { return std::isalpha(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  const auto digit = [](char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; };
  return !name.empty() && letter(name.front()) &&
         std::ranges::all_of(name, [&](char c) { return letter(c) || digit(c); });
}

bool is_base_parameter(std::string_view name) {
  return std::ranges::find(base_parameters, name, &BaseParameter::symbol) != base_parameters.end();
}

void check_id(const YamlMap& effects, const std::string& id) {
  if (!is_word(id)) effects.fail(id, "is no name for an effect. Use letters, digits and _, a letter first");
  if (std::ranges::find(effect_catalogue(), id, &EffectInfo::id) != effect_catalogue().end()) {
    effects.fail(id, "is an effect of the library, but stands here with a formula. Give the formula another name");
  }
  if (is_base_parameter(id)) effects.fail(id, "is a parameter of the base model. Give the formula another name");
}

void check_symbol(const YamlMap& parameters, const std::string& symbol) {
  if (!is_word(symbol)) parameters.fail(symbol, "is no name for a parameter. Use letters, digits and _");
  if (is_base_parameter(symbol)) {
    parameters.fail(symbol, "is a parameter of the base model; a formula has its own. Give it another name");
  }
  if (means_something_in_formulas(symbol)) {
    parameters.fail(symbol, "means something else in formulas. Give the parameter another name");
  }
}

/// A parameter of a formula, and where it makes the effect vanish; nothing for a shape.
struct FormulaParameter {
  Parameter parameter;
  std::optional<double> null;
};

FormulaParameter read_formula_parameter(const YamlMap& parameters, const std::string& symbol) {
  check_symbol(parameters, symbol);
  const YamlMap yaml = parameters.map(symbol);
  yaml.only({"value", "min", "max", "unit", "null", "fixed", "prior", "std_error"});
  FormulaParameter p{read_parameter_body(yaml, symbol, yaml.text_or("unit", ""), -infinity, infinity), {}};
  if (yaml.has("null")) {
    p.null = yaml.number("null");
    if (!p.parameter.fixed && (*p.null < p.parameter.min || *p.null > p.parameter.max)) {
      yaml.fail("null", "is outside min and max: a search starts there");
    }
  } else if (!p.parameter.fixed && p.parameter.min <= 0 && p.parameter.max >= 0) {
    p.null = 0;
  }
  if (p.parameter.fixed) p.null.reset();
  return p;
}

/// What a search and the reports must know of an effect, with the texts that it refers to.
struct FormulaInfo {
  AddedTerm term;
  std::string equation;
  EffectInfo info;
};

std::shared_ptr<const EffectInfo> describe(const AddedTerm& term, std::span<const FormulaParameter> parameters) {
  const auto made = std::make_shared<FormulaInfo>();
  made->term = term;
  made->equation = described(term.place).equation + term.formula;
  if (term.rate) made->equation += ", d" + term.memory + "/dt = " + term.rate_formula;
  EffectInfo& info = made->info;
  info.id = info.name = made->term.name;
  info.stage = described(term.place).stage;
  info.equation = made->equation;
  info.what = "A formula of the user.";
  info.shows = "As its formula says.";
  info.told_apart = "Only runs in which the two formulas differ can tell them apart.";
  info.source = "the user";
  info.parameter_count = parameters.size();
  info.opposes_motion = true;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = made->term.parameters[i];
    const std::optional<double>& null = parameters[i].null;
    info.parameter_list[i] = {.symbol = p.symbol,
                              .unit = p.unit,
                              .null = null.value_or(p.value),
                              .min = p.fixed ? p.value : p.min,
                              .max = p.fixed ? p.value : p.max,
                              .typical = std::abs(p.value),
                              .role = null ? Role::amplitude : Role::shape};
    if (null && p.min < *null) info.opposes_motion = false;
  }
  return {made, &made->info};
}

/// A formula's value at one speed and current.
double value_at(const Term& formula, std::span<const double> p, const TermInput& x) {
  TermInput by_input;
  std::vector<double> by_parameter(p.size());
  return formula.evaluate(x, p, by_input, by_parameter);
}

void check_values(const YamlMap& yaml, const AddedTerm& term) {
  const char* key = described(term.place).key;
  std::vector<double> values, nulls;
  bool any_null = false;
  for (std::size_t i = 0; i < term.parameters.size(); ++i) {
    const EffectParameter& about = term.info->parameter_list[i];
    values.push_back(term.parameters[i].value);
    nulls.push_back(about.null);
    any_null = any_null || !about.is_shape();
  }
  const auto check_at_rest = [&](const Term& formula, const YamlMap& map, std::string_view under) {
    const double rest = value_at(formula, values, {});
    if (std::isfinite(rest)) return;
    map.fail(under,
             "is " + yaml_number(rest) + " at rest (omega, i_a, theta, u_ref and t 0). Write it so that it is finite");
  };
  check_at_rest(*term.term, yaml, key);
  if (term.rate) check_at_rest(*term.rate, yaml.map("memory"), term.memory);
  if (!any_null) return;
  const double absent = term.place == TermPlace::flux ? 1 : 0;
  std::vector<double> by_parameter(nulls.size());
  for (TermInput x : {TermInput{}, TermInput{10, 1, 1, 1, 1}, TermInput{-10, -1, 2, -1, 2}}) {
    if (term.rate) x.memory = lasting_memory<double>(rate_over_memory(*term.rate, x, nulls, by_parameter));
    const double value = value_at(*term.term, nulls, x);
    if (std::abs(value - absent) <= 1e-9) continue;
    if (!std::isfinite(value)) {
      yaml.fail(key, "is not finite at omega " + yaml_number(x.omega) + ", i_a " + yaml_number(x.i_a) +
                         ". Write it for both signs, e.g. sign(omega)*abs(omega)^1.5");
    }
    yaml.fail(key, "is " + yaml_number(value) + " where its parameters have their null, but must be " +
                       yaml_number(absent) + ": there the effect is absent. State each `null`");
  }
}

/// What a formula remembers: `memory: {z: "(omega - z)/tau"}`.
void read_memory(const YamlMap& yaml, std::span<const std::string> parameters, AddedTerm& term) {
  const auto memory = yaml.map_if("memory");
  if (!memory) return;
  const std::vector<std::string> names = memory->keys();
  if (names.size() != 1) {
    yaml.fail("memory", "names " + std::to_string(names.size()) +
                            " quantities, but a formula remembers one, e.g. memory: {z: \"(omega - z)/tau\"}");
  }
  check_symbol(*memory, names.front());
  if (std::ranges::find(parameters, names.front()) != parameters.end()) {
    memory->fail(names.front(), "is a parameter, too. Give one of them another name");
  }
  term.memory = names.front();
  term.rate_formula = memory->text(term.memory);
}

/// Work on a formula, of which a complaint names the key. @param work throws ModelError
template <class Work>
auto told_at(const YamlMap& map, std::string_view key, const Work& work) {
  try {
    return work();
  } catch (const ModelError& e) {
    map.fail(key, e.what());
  }
}

/// Reads what a term's formulas say. @param key of its own one
void parse(const YamlMap& yaml, const char* key, std::span<const std::string> parameters, AddedTerm& term) {
  ParsedFormula value = told_at(yaml, key, [&] { return parse_formula_with(term.memory, term.formula, parameters); });
  term.term = value.term;
  if (!term.memory.empty()) {
    if (!value.uses_memory) yaml.fail(key, "does not use " + term.memory + ", which stands under `memory`. Use it");
    const ParsedFormula rate = told_at(yaml.map("memory"), term.memory,
                                       [&] { return parse_formula_with(term.memory, term.rate_formula, parameters); });
    term.rate = rate.term;
    for (std::size_t i = 0; i < value.uses.size(); ++i) value.uses[i] = value.uses[i] || rate.uses[i];
  }
  told_at(yaml, key, [&] { check_all_used(parameters, value.uses); });
}

bool is_same_formula(const AddedTerm& a, const AddedTerm& b) {
  return a.formula == b.formula && a.place == b.place && a.memory == b.memory && a.rate_formula == b.rate_formula;
}

}  // namespace

bool is_formula(const YamlMap& effects, std::string_view id) {
  const YAML::Node node = effects.map(id).node();
  return std::ranges::any_of(place_keys, [&](const PlaceKey& p) { return node[p.key].IsDefined(); });
}

AddedTerm read_formula(const YamlMap& effects, const std::string& id) {
  check_id(effects, id);
  const YamlMap yaml = effects.map(id);
  yaml.only({"torque", "voltage", "flux", "parameters", "memory"});
  const PlaceKey* place = nullptr;
  for (const PlaceKey& candidate : place_keys) {
    if (!yaml.has(candidate.key)) continue;
    if (place != nullptr) yaml.fail(candidate.key, "stands beside " + std::string(place->key) + ". Write one of them");
    place = &candidate;
  }
  if (place == nullptr) yaml.fail("", "needs a formula: torque, voltage or flux, e.g. torque: \"-c3*omega^3\"");

  std::vector<FormulaParameter> parameters;
  if (const auto given = yaml.map_if("parameters")) {
    for (const std::string& symbol : given->keys()) parameters.push_back(read_formula_parameter(*given, symbol));
  }
  if (parameters.size() > EffectInfo::max_parameters) {
    yaml.fail("parameters", "are " + std::to_string(parameters.size()) + ", but a formula has at most " +
                                std::to_string(EffectInfo::max_parameters));
  }
  // Where the library's effects have it, too: the amplitude first, which stands for the size of the effect.
  std::stable_partition(parameters.begin(), parameters.end(),
                        [](const FormulaParameter& p) { return p.null.has_value(); });
  AddedTerm term;
  term.name = id;
  term.place = place->place;
  term.formula = yaml.text(place->key);
  std::vector<std::string> symbols;
  for (const FormulaParameter& p : parameters) {
    term.parameters.push_back(p.parameter);
    symbols.push_back(p.parameter.symbol);
  }
  read_memory(yaml, symbols, term);
  parse(yaml, place->key, symbols, term);
  term.info = describe(term, parameters);
  check_values(yaml, term);
  return term;
}

void write_formula(YAML::Emitter& out, const AddedTerm& term) {
  out << YAML::Key << term.name << YAML::Value << YAML::BeginMap;
  out << YAML::Key << described(term.place).key << YAML::Value << YAML::DoubleQuoted << term.formula;
  if (term.rate) {
    out << YAML::Key << "memory" << YAML::Value << YAML::Flow << YAML::BeginMap << YAML::Key << term.memory
        << YAML::Value << YAML::DoubleQuoted << term.rate_formula << YAML::EndMap;
  }
  if (!term.parameters.empty()) {
    out << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap;
    for (std::size_t i = 0; i < term.parameters.size(); ++i) {
      const EffectParameter& about = term.info->parameter_list[i];
      write_parameter(out, term.parameters[i], about.is_shape() ? 0 : about.null);
    }
    out << YAML::EndMap;
  }
  out << YAML::EndMap;
}

std::vector<AddedTerm> read_candidates(const std::filesystem::path& path) {
  YamlMap yaml = YamlMap::load(path);
  if (yaml.keys() == std::vector<std::string>{"effects"}) yaml = yaml.map("effects");
  std::vector<AddedTerm> all;
  for (const std::string& id : yaml.keys()) all.push_back(read_formula(yaml, id));
  if (all.empty()) yaml.fail("", "holds no formula");
  return all;
}

void offer(Model& model, const std::filesystem::path& candidates) {
  model.offered = read_candidates(candidates);
  for (const AddedTerm& formula : model.offered) {
    const auto same = std::ranges::find(model.terms, formula.name, &AddedTerm::name);
    if (same == model.terms.end() || is_same_formula(*same, formula)) continue;
    throw ConfigError(candidates.string() + ": " + formula.name +
                      " stands in the model with another formula. Give one of them another name");
  }
}

}  // namespace emtb
