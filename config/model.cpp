#include "config/model.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "config/format.h"
#include "config/formula_effect.h"
#include "config/parameter.h"
#include "hal/error.h"
#include "hal/format_version.h"
#include "hal/one_line.h"
#include "model/catalogue.h"

namespace emtb {
namespace {

/// The physical lower limit of a base parameter: all but friction must be above zero.
double least_of(std::string_view symbol) { return symbol == "B" ? 0.0 : 1e-12; }

void read_base(const YamlMap& yaml, Model& model) {
  const YamlMap parameters = yaml.map("parameters");
  parameters.only({"R_a", "K_b", "K_m", "B", "J"});
  constexpr double unset = std::numeric_limits<double>::infinity();
  for (const BaseParameter& b : base_parameters) {
    const std::string symbol(b.symbol);
    if (parameters.has(symbol)) {
      model.base.push_back(read_parameter(parameters, symbol, b.unit, least_of(symbol), unset));
      continue;
    }
    const bool circuit = symbol == "R_a" || symbol == "K_b";
    if (model.tie.contains(symbol) || (model.input == Signal::i_a && circuit)) {
      // Tied: its leader's value is used. A current drive: the armature circuit does not matter.
      model.base.push_back({symbol, std::string(b.unit), 1, 1, 1, true, {}, {}});
      continue;
    }
    parameters.fail(symbol, symbol == "K_m" ? "is missing. Add it, or write `tie: {K_m: K_b}`" : "is missing");
  }
}

void read_driver(const YamlMap& yaml, Model& model) {
  const auto d = yaml.map_if("driver");
  if (!d) return;
  d->only({"gain", "rise", "fall", "min", "max"});
  DriverModel driver;
  driver.gain = d->number_or("gain", 1);
  if (driver.gain == 0) d->fail("gain", "must not be 0");
  if (d->has("rise")) driver.rise = d->positive("rise");
  if (d->has("fall")) driver.fall = d->positive("fall");
  driver.min = d->number_or("min", driver.min);
  driver.max = d->number_or("max", driver.max);
  if (driver.max <= driver.min) d->fail("max", "must be above min");
  model.driver = driver;
}

void read_effects(const YamlMap& yaml, Model& model) {
  const auto effects = yaml.map_if("effects");
  if (!effects) return;
  for (const std::string& id : effects->keys()) {
    if (is_formula(*effects, id)) {
      model.terms.push_back(read_formula(*effects, id));
      continue;
    }
    std::size_t effect = 0;
    try {
      effect = effect_index(id);
    } catch (const ModelError& e) {
      const std::string what = e.what();
      effects->fail(id, "is an " + what + (what.ends_with('?') ? " " : ". ") +
                            "A formula of your own: {torque: \"-c3*omega^3\", ...}");
    }
    if (model.includes(effect)) effects->fail(id, "stands twice. Keep one");
    model.include(effect);
    const YamlMap given = effects->map(id);
    IncludedEffect& included = *std::ranges::find(model.effects, effect, &IncludedEffect::effect);
    for (const std::string& key : given.keys()) {
      if (std::ranges::find(included.parameters, key, &Parameter::symbol) == included.parameters.end()) {
        given.fail(key, "is not a parameter of " + id);
      }
    }
    for (Parameter& p : included.parameters) {
      if (given.has(p.symbol)) p = read_parameter(given, p.symbol, p.unit, p.min, p.max);
    }
  }
}

/// One of two words, the first for yes.
std::optional<bool> either(const YamlMap& yaml, const std::string& key, const std::string& yes, const std::string& no) {
  if (!yaml.has(key)) return std::nullopt;
  const std::string word = yaml.text(key);
  if (word != yes && word != no) yaml.fail(key, "is `" + word + "`. Write " + yes + " or " + no);
  return word == yes;
}

void read_bench_facts(const YamlMap& yaml, Model& model) {
  const auto bench = yaml.map_if("bench");
  if (!bench) return;
  bench->only({"field", "speed"});
  model.bench.field_winding = either(*bench, "field", "winding", "magnets");
  model.bench.tachogenerator = either(*bench, "speed", "tachogenerator", "encoder");
}

void read_history(const YamlMap& yaml, Model& model) {
  for (const YamlMap& entry : yaml.maps("history")) {
    entry.only({"action", "train", "held_out", "sessions"});
    HistoryEntry h;
    h.action = entry.text("action");
    if (entry.has("train")) h.train = entry.number("train");
    if (entry.has("held_out")) h.held_out = entry.number("held_out");
    if (entry.has("sessions")) h.sessions = entry.texts("sessions");
    model.history.push_back(std::move(h));
  }
}

}  // namespace

Model read_model(const std::filesystem::path& path) { return read_model(YamlMap::load(path)); }

Model read_model(const YamlMap& yaml) {
  read_format(yaml, "model", newest_format::model);
  yaml.only({"format", "name", "input", "driver", "tie", "parameters", "bench", "noise", "effects", "history"});
  Model model;
  model.name = in_one_line(yaml.text_or("name", yaml.file().stem().string()));
  const std::string input = yaml.text_or("input", "u_ref");
  model.input = signal_named(input).value_or(Signal::temperature);
  if (model.input != Signal::u_ref && model.input != Signal::e_a && model.input != Signal::i_a) {
    yaml.fail("input", "is `" + input + "`. Write u_ref, e_a, or i_a for a current drive");
  }
  read_driver(yaml, model);
  if (const auto tie = yaml.map_if("tie")) {
    for (const std::string& follower : tie->keys()) model.tie[follower] = tie->text(follower);
  }
  read_base(yaml, model);
  read_effects(yaml, model);
  const std::vector<std::string> names = model.names();
  for (const auto& [follower, leader] : model.tie) {
    for (const std::string& name : {follower, leader}) {
      if (std::ranges::find(names, name) == names.end())
        yaml.fail("tie", "names `" + name + "`, which is no parameter here");
    }
    if (model.tie.contains(leader)) yaml.fail("tie", "ties " + follower + " to " + leader + ", which is tied itself");
  }
  read_bench_facts(yaml, model);
  if (const auto noise = yaml.map_if("noise")) {
    for (const std::string& key : noise->keys()) {
      const auto signal = signal_named(key);
      if (!signal) noise->fail(key, "is not a signal");
      model.noise[*signal] = noise->positive(key);
    }
  }
  read_history(yaml, model);
  return model;
}

std::string to_yaml(const Model& model) {
  YAML::Emitter out;
  out << YAML::BeginMap;
  out << YAML::Key << "format" << YAML::Value << format_words("model", newest_format::model);
  out << YAML::Key << "name" << YAML::Value << model.name;
  out << YAML::Key << "input" << YAML::Value << std::string(info(model.input).name);
  if (model.driver) {
    const DriverModel& d = *model.driver;
    out << YAML::Key << "driver" << YAML::Value << YAML::Flow << YAML::BeginMap;
    out << YAML::Key << "gain" << YAML::Value << yaml_number(d.gain);
    const auto known = [&](const char* key, double value) {
      if (std::abs(value) < DriverModel::unlimited) out << YAML::Key << key << YAML::Value << yaml_number(value);
    };
    known("rise", d.rise);
    known("fall", d.fall);
    known("min", d.min);
    known("max", d.max);
    out << YAML::EndMap;
  }
  if (!model.tie.empty()) out << YAML::Key << "tie" << YAML::Value << YAML::Flow << model.tie;
  out << YAML::Key << "parameters" << YAML::Value << YAML::BeginMap;
  for (const Parameter& p : model.base) {
    if (!model.tie.contains(p.symbol)) write_parameter(out, p);
  }
  out << YAML::EndMap;
  const auto& [winding, tachogenerator] = model.bench;
  if (winding || tachogenerator) {
    out << YAML::Key << "bench" << YAML::Value << YAML::Flow << YAML::BeginMap;
    if (winding) out << YAML::Key << "field" << YAML::Value << (*winding ? "winding" : "magnets");
    if (tachogenerator) out << YAML::Key << "speed" << YAML::Value << (*tachogenerator ? "tachogenerator" : "encoder");
    out << YAML::EndMap;
  }
  if (!model.noise.empty()) {
    out << YAML::Key << "noise" << YAML::Value << YAML::Flow << YAML::BeginMap;
    for (const auto& [signal, sigma] : model.noise) {
      out << YAML::Key << std::string(info(signal).name) << YAML::Value << yaml_number(sigma);
    }
    out << YAML::EndMap;
  }
  out << YAML::Key << "effects" << YAML::Value;
  if (model.effects.empty() && model.terms.empty()) out << YAML::Flow;
  out << YAML::BeginMap;
  for (const IncludedEffect& e : model.effects) {
    out << YAML::Key << std::string(effect_catalogue()[e.effect].id) << YAML::Value << YAML::BeginMap;
    for (const Parameter& p : e.parameters) write_parameter(out, p);
    out << YAML::EndMap;
  }
  for (const AddedTerm& term : model.terms) write_formula(out, term);
  out << YAML::EndMap;
  out << YAML::Key << "history" << YAML::Value;
  if (model.history.empty()) out << YAML::Flow;
  out << YAML::BeginSeq;
  for (const HistoryEntry& h : model.history) {
    out << YAML::Flow << YAML::BeginMap << YAML::Key << "action" << YAML::Value << h.action;
    if (h.train && std::isfinite(*h.train)) out << YAML::Key << "train" << YAML::Value << yaml_number(*h.train);
    if (h.held_out && std::isfinite(*h.held_out))
      out << YAML::Key << "held_out" << YAML::Value << yaml_number(*h.held_out);
    if (!h.sessions.empty()) out << YAML::Key << "sessions" << YAML::Value << YAML::Flow << h.sessions;
    out << YAML::EndMap;
  }
  out << YAML::EndSeq << YAML::EndMap;
  return std::string(out.c_str()) + "\n";
}

void write_model(const std::filesystem::path& path, const Model& model) {
  std::ofstream file(path);
  file << to_yaml(model);
  file.close();
  if (!file) throw ConfigError(path.string() + ": cannot be written");
}

}  // namespace emtb
