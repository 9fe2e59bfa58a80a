#include "tools/page/work.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <tuple>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/refit.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "config/formula_effect.h"
#include "config/mapping.h"
#include "config/model.h"
#include "hal/error.h"
#include "hal/unit.h"
#include "model/catalogue.h"
#include "report/symbols.h"
#include "report/text.h"
#include "server/rpc.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/checked.h"
#include "tools/page/numbers.h"

namespace emtb::page {
namespace {

constexpr std::size_t most_steps_back = 200;

std::size_t place_of(const Model& model, const std::string& parameter) {
  const std::vector<std::string> names = model.names();
  const auto found = std::ranges::find(names, parameter);
  if (found == names.end()) throw Error("the model has no parameter " + parameter);
  return static_cast<std::size_t>(found - names.begin());
}

json effect_json(const std::string& id, const std::string& name, const std::vector<Parameter>& parameters) {
  json names = json::array();
  for (const Parameter& p : parameters) names.push_back(id + "." + p.symbol);
  return {{"id", id}, {"name", name}, {"parameters", names}};
}

json parameter_json(const Model& model, std::size_t i, const std::string& name, double value,
                    const std::vector<std::string>& at_bound) {
  const Parameter& p = model.at(i);
  json out{{"value", value},
           {"min", number(p.min)},
           {"max", number(p.max)},
           {"unit", p.unit},
           {"std_error", p.std_error ? number(*p.std_error) : json(nullptr)},
           {"fixed", p.fixed},
           {"at_bound", std::ranges::find(at_bound, name) != at_bound.end()}};
  if (const auto tie = model.tie.find(name); tie != model.tie.end()) out["tied_to"] = tie->second;
  return out;
}

/// Of the signal that is furthest off, and all others, in one record.
json rows_of(const Record& record, const Model& model, const Noise& noise, bool held_out) {
  json rows = json::array();
  for (const auto& [signal, fit] : fit_of(std::span(&record, 1), model, noise)) {
    rows.push_back({{"run", short_name(record.name)},
                    {"signal", info(signal).name},
                    {"unit", info(signal).unit},
                    {"rmse", number(fit.rmse)},
                    {"floors", number(fit.ratio)},
                    {"fit_percent", fit.moves ? number(fit.fit_percent) : json(nullptr)},
                    {"held_out", held_out}});
  }
  return rows;
}

}  // namespace

Work::Work(Files files) : files_(std::move(files)) {
  if (!files_.any()) throw rpc::Refusal(rpc::code::not_available, "this page shows the bench: it was given no files");
  given_ = read_model(files_.model);
  if (!files_.map.empty()) mapping_ = read_mapping(files_.map);
  train_specs_ = files_.sessions;
  held_out_specs_ = files_.held_out;
  now_ = {.model = given_, .steps = {}, .at_bound = {}, .label = ""};
  restore();
  load_runs();
  if (now_.steps.empty()) now_.steps.push_back(step_of("", now_.model));
}

void Work::load_runs() {
  const auto given = [this](const std::vector<std::string>& specs) {
    std::vector<Run> runs;
    for (const std::string& spec : specs) {
      for (Run& run : split_at_gaps(read_runs(spec, mapping_), given_.input)) {
        runs.push_back(std::move(run));
        sessions_.push_back(parse_session_spec(spec).path.string());
      }
    }
    refuse_slow_readings(runs);
    return runs;
  };
  sessions_.clear();
  train_ = given(train_specs_);
  held_out_ = given(held_out_specs_);
  std::ostringstream findings;
  findings_ = may_be_fitted(train_, held_out_, given_, false, findings) ? "" : findings.str();
  data_ = prepare(train_, held_out_, given_);
  const auto signal = [](const Noise::value_type& of) { return of.first; };
  if (std::ranges::equal(quieter_, data_.noise, {}, signal, signal)) set_noise(data_, quieter_, given_);
  settle_timing(data_, now_.model);
  settle_starts(data_, now_.model);
  diagnosis_.reset();
  rest_.reset();
}

std::vector<const Record*> Work::records() const {
  std::vector<const Record*> all;
  for (const Record& r : data_.train) all.push_back(&r);
  for (const Record& r : data_.held_out) all.push_back(&r);
  return all;
}

const Record& Work::record(const std::string& id) const {
  const auto all = records();
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (std::to_string(i) == id) return *all[i];
  }
  throw Error("there is no run " + id);
}

Work::Step Work::step_of(const std::string& added, const Model& model) const {
  return {added, error_on(data_.train, model), error_on(data_.held_out, model)};
}

json Work::state() const {
  const Model& m = now_.model;
  json out{{"name", m.name}, {"saved", file_.string()}, {"parameters", json::object()}};
  out["undo"] = past_.empty() ? json(nullptr) : json(now_.label);
  out["redo"] = future_.empty() ? json(nullptr) : json(future_.back().label);
  const std::vector<std::string> names = m.names();
  const std::vector<double> values = m.values();
  out["order"] = names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    out["parameters"][names[i]] = parameter_json(m, i, names[i], values[i], now_.at_bound);
  }
  out["effects"] = json::array();
  for (const IncludedEffect& e : m.effects) {
    const EffectInfo& about = effect_catalogue()[e.effect];
    out["effects"].push_back(effect_json(std::string(about.id), std::string(about.name), e.parameters));
  }
  for (const AddedTerm& t : m.terms) out["effects"].push_back(effect_json(t.name, t.name, t.parameters));
  out["runs"] = json::array();
  out["table"] = json::array();
  const auto all = records();
  for (std::size_t i = 0; i < all.size(); ++i) {
    out["runs"].push_back({{"id", std::to_string(i)},
                           {"name", short_name(all[i]->name)},
                           {"session", sessions_.at(i)},
                           {"held_out", held_out(i)},
                           {"duration", number(all[i]->excitation.t.back())}});
    for (json& row : rows_of(*all[i], m, data_.noise, held_out(i))) out["table"].push_back(std::move(row));
  }
  out["signals"] = json::array();
  for (const auto& [signal, floor] : data_.noise) {
    out["signals"].push_back(
        {{"name", info(signal).name}, {"unit", info(signal).unit}, {"floor", number(floor.sigma)}});
  }
  out["error"] = {{"train", number(error_on(data_.train, m))}, {"held_out", number(error_on(data_.held_out, m))}};
  out["steps"] = json::array();
  for (const Step& s : now_.steps) {
    out["steps"].push_back({{"added", s.added.empty() ? json(nullptr) : json(s.added)},
                            {"train", number(s.train)},
                            {"held_out", number(s.held_out)}});
  }
  out["findings"] = findings_;
  return out;
}

void Work::change(State next, const std::string& label) {
  past_.push_back(std::move(now_));
  if (past_.size() > most_steps_back) past_.erase(past_.begin());
  future_.clear();
  now_ = std::move(next);
  now_.label = label;
  save();
}

void Work::set(const json& params) {
  State next = now_;
  std::string label = "set";
  const json values = params.value("parameters", json::object()), limits = params.value("bounds", json::object());
  for (const auto& [name, value] : values.items()) {
    Parameter& p = next.model.at(place_of(next.model, name));
    if (next.model.tie.contains(name)) throw Error(name + " follows " + next.model.tie.at(name) + ": set that one");
    if (!value.is_number()) throw Error(name + " needs a number");
    const double number = value;
    if (!p.fixed && !(number >= p.min && number <= p.max)) {
      throw Error(name + " must be " + pretty(p.min) + " to " + pretty(p.max) + with_space(p.unit));
    }
    p.value = number;
    p.std_error.reset();
    std::erase(next.at_bound, name);
    label += " " + name;
  }
  for (const auto& [name, bounds] : limits.items()) {
    Parameter& p = next.model.at(place_of(next.model, name));
    if (!bounds.is_array() || bounds.size() != 2 || !bounds[0].is_number() || !bounds[1].is_number() ||
        !(bounds[0] < bounds[1])) {
      throw Error("the bounds of " + name + " are two numbers, the lower one first");
    }
    p.min = bounds[0];
    p.max = bounds[1];
    p.value = std::clamp(p.value, p.min, p.max);
    label += " bounds of " + name;
  }
  change(std::move(next), label);
}

void Work::lock(const json& params) {
  const rpc::Params checked(params);
  const std::string name = checked.text("parameter");
  State next = now_;
  Parameter& p = next.model.at(place_of(next.model, name));
  p.fixed = checked.flag_or("fixed", true);
  if (!p.fixed && !(std::isfinite(p.min) && std::isfinite(p.max) && p.min < p.max)) {
    throw Error(name + " has no bounds in the model file, so it cannot be fitted: set its bounds first");
  }
  change(std::move(next), (p.fixed ? "lock " : "unlock ") + name);
}

void Work::refuse_unless_fit_for_fitting() const {
  if (!findings_.empty()) throw Error("nothing can be fitted to these recordings. " + findings_);
}

void Work::refit(const Model& start, State& next) {
  Calibration c = calibrate(data_, start);
  next.model = c.model;
  next.at_bound = c.at_bound;
}

void Work::fit() {
  refuse_unless_fit_for_fitting();
  State next = now_;
  refit(now_.model, next);
  next.steps.back() = step_of(next.steps.back().added, next.model);
  next.model.history.push_back({"calibrated", next.steps.back().train, {}, train_specs_});
  change(std::move(next), "fit");
}

void Work::add(std::size_t effect) {
  refuse_unless_fit_for_fitting();
  const std::string id(now_.model.about(effect).id);
  if (now_.model.includes(effect)) throw Error("the model includes " + id + " already");
  const Calibration before = calibrate(data_, now_.model);
  const Fit begun = begun_refit_with(data_.train, before, now_.model, effect);
  if (!std::isfinite(begun.cost)) throw Error("the model cannot be simulated with " + id + ": it leaves all bounds");
  State next = now_;
  next.steps.back() = step_of(next.steps.back().added, before.model);
  refit(begun.model, next);
  next.steps.push_back(step_of(id, next.model));
  next.model.history.push_back({"added " + id, next.steps.back().train, {}, train_specs_});
  next.model.offered.clear();
  change(std::move(next), "add " + id);
}

Model Work::with_formula(const json& formula) const {
  const rpc::Params checked(formula);
  const std::string id = checked.text("id"), place = checked.text("place");
  if (place != "torque" && place != "voltage" && place != "flux") throw Error("`place` is torque, voltage or flux");
  const json asked = formula.value("parameters", json::object());
  json parameters = json::object();
  for (const auto& [name, given] : asked.items()) {
    json one = json::object();
    for (const char* key : {"value", "min", "max"}) one[key] = given.value(key, key == std::string("max") ? 1.0 : 0.0);
    one["unit"] = given.value("unit", "1");
    if (given.value("fixed", false)) one = {{"value", one["value"]}, {"fixed", true}, {"unit", one["unit"]}};
    parameters[name] = one;
  }
  json file = json::object();  // JSON is YAML, too
  file[id][place] = checked.text("formula");
  file[id]["parameters"] = parameters;
  if (formula.contains("memory")) file[id]["memory"] = formula["memory"];
  const auto yaml = YamlMap::parse(file.dump(), "formula");
  Model model = now_.model;
  model.offered = {read_formula(yaml, id)};
  if (std::ranges::find(model.terms, id, &AddedTerm::name) != model.terms.end()) {
    throw Error("the model has a formula " + id + " already: give this one another name");
  }
  return model;
}

void Work::add_formula(const json& formula) {
  const Model before = now_.model;
  now_.model = with_formula(formula);
  try {
    add(effect_count);  // the first that is on offer
  } catch (...) {
    now_.model = before;
    throw;
  }
  past_.back().model.offered.clear();
}

void Work::remove(const std::string& id) {
  State next = now_;
  Model& m = next.model;
  if (const auto term = std::ranges::find(m.terms, id, &AddedTerm::name); term != m.terms.end()) {
    m.terms.erase(term);
  } else {
    const std::size_t effect = m.effect_named(id);
    if (!m.includes(effect)) throw Error("the model has no " + id);
    m.exclude(effect);
  }
  refuse_unless_fit_for_fitting();
  refit(m, next);
  if (next.steps.back().added == id && next.steps.size() > 1) {
    next.steps.pop_back();
    next.steps.back() = step_of(next.steps.back().added, next.model);
  } else {
    next.steps.push_back(step_of("without " + id, next.model));
  }
  next.model.history.push_back({"removed " + id, next.steps.back().train, {}, train_specs_});
  change(std::move(next), "remove " + id);
}

void Work::undo() {
  if (past_.empty()) throw Error("there is nothing to undo");
  future_.push_back(std::move(now_));
  now_ = std::move(past_.back());
  past_.pop_back();
  save();
}

void Work::redo() {
  if (future_.empty()) throw Error("there is nothing to do again");
  past_.push_back(std::move(now_));
  now_ = std::move(future_.back());
  future_.pop_back();
  save();
}

void Work::use(const std::string& session, const std::string& as) {
  if (as != "train" && as != "held_out" && !as.empty())
    throw Error("a session is used as train, held_out or not at all");
  const auto before = std::tuple(train_specs_, held_out_specs_, quieter_);
  const auto same = [&](const std::string& spec) {
    std::error_code ignored;
    return std::filesystem::equivalent(parse_session_spec(spec).path, session, ignored);
  };
  std::erase_if(train_specs_, same);
  std::erase_if(held_out_specs_, same);
  if (as == "train") train_specs_.push_back(session);
  if (as == "held_out") held_out_specs_.push_back(session);
  try {
    if (train_specs_.empty()) throw Error("one session at least is needed to fit to");
    quieter_.clear();
    load_runs();
  } catch (...) {
    std::tie(train_specs_, held_out_specs_, quieter_) = before;
    load_runs();
    throw;
  }
  count_steps_anew();
  save();
}

/// Runs or floors are others now: what was reached with those before is no number beside these.
void Work::count_steps_anew() {
  for (Step& step : now_.steps) step.train = step.held_out = std::nan("");
  now_.steps.back() = step_of(now_.steps.back().added, now_.model);
}

std::string Work::use_of(const std::filesystem::path& session) const {
  const auto among = [&](const std::vector<std::string>& specs) {
    return std::ranges::any_of(specs, [&](const std::string& spec) {
      std::error_code ignored;
      return std::filesystem::equivalent(parse_session_spec(spec).path, session, ignored);
    });
  };
  return among(train_specs_) ? "train" : among(held_out_specs_) ? "held_out" : "";
}

}  // namespace emtb::page
