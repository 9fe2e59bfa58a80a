#include "model/model.h"

#include <algorithm>
#include <utility>

#include "hal/error.h"
#include "model/catalogue.h"

namespace emtb {

ModelStructure Model::structure() const {
  ModelStructure s;
  s.input = input;
  if (driver) s.driver = *driver;
  for (const IncludedEffect& e : effects) s.effects.push_back(e.effect);
  for (const AddedTerm& t : terms) s.terms.push_back(t.placed());
  return s;
}

std::vector<double> values_of(std::span<const Parameter> parameters) {
  std::vector<double> values;
  for (const Parameter& p : parameters) values.push_back(p.value);
  return values;
}

std::vector<double> Model::values() const { return FreeParameters(*this).spread(FreeParameters(*this).pick({})); }

double Model::mechanical_time_constant() const {
  const std::vector<double> p = values();
  const double R_a = p[base::R_a], K_b = p[base::K_b], K_m = p[base::K_m], B = p[base::B], J = p[base::J];
  return input == Signal::i_a ? J / std::max(B, 1e-12) : J * R_a / (K_b * K_m);
}

std::size_t Model::known_effects() const { return effect_count + offered.size(); }

const EffectInfo& Model::about(std::size_t effect) const {
  return effect < effect_count ? effect_catalogue()[effect] : *offered.at(effect - effect_count).info;
}

std::size_t Model::effect_named(std::string_view id) const {
  const auto found = std::ranges::find(offered, id, &AddedTerm::name);
  if (found != offered.end()) return effect_count + static_cast<std::size_t>(found - offered.begin());
  const auto known = std::ranges::find(effect_catalogue(), id, &EffectInfo::id);
  if (known != effect_catalogue().end()) return static_cast<std::size_t>(known - effect_catalogue().begin());
  std::vector<std::string> formulas;
  for (const AddedTerm& formula : offered) formulas.push_back(formula.name);
  throw ModelError(no_such_effect(id, std::move(formulas)));
}

bool Model::withholds(std::size_t effect) const { return std::ranges::find(withheld, effect) != withheld.end(); }

bool Model::includes(std::size_t effect) const {
  if (effect >= effect_count) {
    return std::ranges::find(terms, offered.at(effect - effect_count).name, &AddedTerm::name) != terms.end();
  }
  return std::ranges::find(effects, effect, &IncludedEffect::effect) != effects.end();
}

const std::vector<Parameter>& Model::parameters_of(std::size_t effect) const {
  if (!includes(effect)) throw ModelError("the model does not include " + std::string(about(effect).id));
  if (effect >= effect_count) {
    return std::ranges::find(terms, offered[effect - effect_count].name, &AddedTerm::name)->parameters;
  }
  return std::ranges::find(effects, effect, &IncludedEffect::effect)->parameters;
}

std::vector<Parameter>& Model::parameters_of(std::size_t effect) {
  return const_cast<std::vector<Parameter>&>(std::as_const(*this).parameters_of(effect));
}

namespace {

/// Supplies sag, and batteries are full: but a driver is fed with about as much as it can give.
void bound_by_supply(Parameter& p, double supply) {
  constexpr double least = 0.75, most = 1.3;  // of it
  if (supply >= DriverModel::unlimited || least * supply > p.max || most * supply < p.min) return;
  p.min = std::max(p.min, least * supply);
  p.max = std::min(p.max, most * supply);
  p.value = std::clamp(supply, p.min, p.max);
}

}  // namespace

void Model::include(std::size_t effect) {
  if (includes(effect)) return;
  if (effect >= effect_count) {
    AddedTerm formula = offered[effect - effect_count];
    for (std::size_t i = 0; i < formula.parameters.size(); ++i) {
      Parameter& p = formula.parameters[i];
      if (!p.fixed) p.value = std::clamp(formula.info->parameter_list[i].null, p.min, p.max);
    }
    terms.push_back(std::move(formula));
    return;
  }
  IncludedEffect added{effect, {}};
  for (const EffectParameter& p : effect_catalogue()[effect].parameters()) {
    added.parameters.push_back({.symbol = std::string(p.symbol),
                                .unit = std::string(p.unit),
                                .value = std::min(p.null, p.max),
                                .min = p.min,
                                .max = p.max,
                                .fixed = false,
                                .prior = {},
                                .std_error = {}});
    if (p.role == Role::supply && driver) bound_by_supply(added.parameters.back(), driver->supply());
  }
  effects.insert(std::ranges::lower_bound(effects, effect, {}, &IncludedEffect::effect), std::move(added));
  hold_first_phase();
}

void Model::exclude(std::size_t effect) {
  if (effect >= effect_count) {
    std::erase_if(terms, [&](const AddedTerm& t) { return t.name == offered[effect - effect_count].name; });
    return;
  }
  std::erase_if(effects, [&](const IncludedEffect& e) { return e.effect == effect; });
  hold_first_phase();
}

Model without_sensors(Model model) {
  for (const IncludedEffect& e : std::vector<IncludedEffect>(model.effects)) {
    if (effect_catalogue()[e.effect].stage == Stage::sensors) model.exclude(e.effect);
  }
  return model;
}

bool Model::periodic() const {
  return std::ranges::any_of(effects, [](const IncludedEffect& e) { return effect_catalogue()[e.effect].periodic; });
}

void Model::hold_first_phase() {
  bool first = true;
  for (IncludedEffect& e : effects) {
    const auto phase = effect_catalogue()[e.effect].place_of(Role::phase);
    if (!phase) continue;
    e.parameters[*phase].fixed = first;
    first = false;
  }
}

std::vector<std::string> Model::names() const {
  std::vector<std::string> names;
  for (const Parameter& p : base) names.push_back(p.symbol);
  for (const IncludedEffect& e : effects) {
    for (std::size_t i = 0; i < e.parameters.size(); ++i) {
      names.push_back(full_name(effect_catalogue()[e.effect], i));
    }
  }
  for (const AddedTerm& t : terms) {
    for (const Parameter& p : t.parameters) names.push_back(t.name + "." + p.symbol);
  }
  return names;
}

const Parameter& Model::at(std::size_t i) const {
  if (i < base.size()) return base[i];
  i -= base.size();
  for (const IncludedEffect& e : effects) {
    if (i < e.parameters.size()) return e.parameters[i];
    i -= e.parameters.size();
  }
  for (const AddedTerm& t : terms) {
    if (i < t.parameters.size()) return t.parameters[i];
    i -= t.parameters.size();
  }
  throw ModelError("no such parameter");
}

Parameter& Model::at(std::size_t i) { return const_cast<Parameter&>(std::as_const(*this).at(i)); }

const EffectParameter* Model::known_of(std::size_t place) const {
  if (place < base.size()) return nullptr;
  place -= base.size();
  for (const IncludedEffect& e : effects) {
    if (place < e.parameters.size()) return &effect_catalogue()[e.effect].parameter_list[place];
    place -= e.parameters.size();
  }
  for (const AddedTerm& t : terms) {
    if (place < t.parameters.size()) return t.info ? &t.info->parameter_list[place] : nullptr;
    place -= t.parameters.size();
  }
  throw ModelError("no such parameter");
}

FreeParameters::FreeParameters(const Model& model) {
  const std::vector<std::string> names = model.names();
  movers_.resize(names.size());
  for (std::size_t i = 0; i < names.size(); ++i) {
    all_.push_back(model.at(i).value);
    if (!model.at(i).fixed && !model.tie.contains(names[i])) {
      movers_[i] = free_.size();
      free_.push_back(i);
    }
  }
  for (const auto& [follower, leader] : model.tie) {
    const auto f = std::ranges::find(names, follower);
    const auto l = std::ranges::find(names, leader);
    if (f == names.end() || l == names.end()) continue;  // the tie of an effect that is not included
    const auto from = static_cast<std::size_t>(l - names.begin());
    const auto to = static_cast<std::size_t>(f - names.begin());
    movers_[to] = movers_[from];
    all_[to] = all_[from];
  }
}

std::vector<double> FreeParameters::pick(std::span<const double> all) const {
  std::vector<double> free;
  for (const std::size_t i : free_) free.push_back(all.empty() ? all_[i] : all[i]);
  return free;
}

std::vector<double> FreeParameters::spread(std::span<const double> free) const {
  std::vector<double> all = all_;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (movers_[i]) all[i] = free[*movers_[i]];
  }
  return all;
}

Model with_values(Model model, const FreeParameters& free, std::span<const double> x) {
  const std::vector<double> all = free.spread(x);
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (free.mover(i) || !model.at(i).fixed) model.at(i).value = all[i];
  }
  return model;
}

}  // namespace emtb
