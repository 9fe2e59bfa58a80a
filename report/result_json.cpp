#include "report/result_json.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "config/profile.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "report/gauge_words.h"
#include "report/rest_words.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

std::string name(Signal signal) { return std::string(info(signal).name); }

json parameter_json(const Parameter& p) {
  return {{"value", p.value}, {"std_error", number_json(p.std_error)}, {"unit", p.unit}};
}

json maps_json(const std::vector<ResidualMap>& maps) {
  json list = json::array();
  for (const ResidualMap& m : maps) {
    list.push_back({{"signal", name(m.signal)},
                    {"against", name_of(m.against)},
                    {"bins", m.bins},
                    {"mean", m.mean},
                    {"rmse", m.rmse},
                    {"floors", m.ratio},
                    {"explained", m.explained}});
  }
  return list;
}

/// What the instrument does not explain; null where it explains all.
json rest_json(Signal signal, const Rest& rest) {
  if (rest.rms <= 0) return nullptr;
  const auto known = [](double value) { return value > 0 ? number_json(value) : json(nullptr); };
  json out{{"rms", number_json(rest.rms)}, {"lasts", known(rest.lasts)}};
  if (signal == Signal::omega) out["like_torque"] = known(rest.like);
  if (signal == Signal::i_a) out["like_voltage"] = known(rest.like);
  if (rest.like > 0 && rest.applied > 0) out["like_percent"] = 100 * rest.like / rest.applied;
  return out;
}

json undetermined_json(const std::vector<Undetermined>& list) {
  json out = json::array();
  for (const Undetermined& u : list) {
    out.push_back({{"combination", u.combination}, {"relative_error", number_json(u.relative_error)}});
  }
  return out;
}

json pins_json(const std::vector<Pin>& pins) {
  json list = json::array();
  for (const Pin& pin : pins) {
    json followers = json::object();
    for (const Follower& f : pin.followers) followers[f.parameter] = number_json(f.power);
    list.push_back({{"parameter", pin.parameter},
                    {"value", pin.value},
                    {"unit", pin.unit},
                    {"text", in_words(pin)},
                    {"powers", followers}});
  }
  return list;
}

json curves_json(const std::vector<MissingCurve>& curves) {
  json list = json::array();
  for (const MissingCurve& c : curves) {
    list.push_back({{"quantity", c.quantity},
                    {"unit", c.unit},
                    {"against", c.against},
                    {"x", c.x},
                    {"value", c.value},
                    {"std_error", c.std_error}});
  }
  return list;
}

}  // namespace

json number_json(double value) { return std::isfinite(value) ? json(value) : json(nullptr); }
json number_json(const std::optional<double>& value) { return value ? number_json(*value) : json(nullptr); }

json to_json(const std::map<Signal, SignalFit>& signals) {
  json out = json::object();
  for (const auto& [signal, fit] : signals) {
    out[name(signal)] = {{"sigma", fit.noise.sigma},
                         {"sigma_from", name_of(fit.noise.from)},
                         {"lower_bound", fit.noise.lower_bound},
                         {"rmse", fit.rmse},
                         {"floors", fit.ratio},
                         {"fit_percent", fit.fit_percent},
                         {"unit", std::string(info(signal).unit)},
                         {"upper_bound", fit.noise.upper_bound},
                         {"rest", rest_json(signal, fit.rest)}};
  }
  return out;
}

json timing_json(const Timing& timing, double interval, const Model& model) {
  json late = json::object();
  for (const auto& [signal, samples] : timing.late) late[name(signal)] = samples;
  return {{"acts_after", timing.acts_after - static_cast<double>(timing.rows_early) * interval},
          {"held", timing.held},
          {"late", late},
          {"voltage_rows_late", timing.voltage_late},
          {"text", in_words(timing, interval, model)}};
}

json parameters_json(const Model& model, const LikelihoodIntervals& intervals, std::span<const Pin> pins) {
  json out = json::object();
  const std::vector<std::string> names = model.names();
  const std::vector<double> values = model.values();
  for (std::size_t i = 0; i < names.size(); ++i) {
    Parameter p = model.at(i);
    p.value = values[i];
    if (const auto tie = model.tie.find(names[i]); tie != model.tie.end()) {
      for (std::size_t j = 0; j < names.size(); ++j) {
        if (names[j] == tie->second) p.std_error = model.at(j).std_error;
      }
    }
    out[names[i]] = parameter_json(p);
    if (p.pinned) out[names[i]]["pinned"] = true;
    const auto tie = model.tie.find(names[i]);
    const std::vector<std::string> with = scaled_with(pins, tie != model.tie.end() ? tie->second : names[i]);
    if (!with.empty()) out[names[i]]["scaled_with"] = with;
    if (const auto interval = intervals.find(names[i]); interval != intervals.end()) {
      const LikelihoodInterval& v = interval->second;
      out[names[i]]["interval95"] = {
          {"low", v.low}, {"high", v.high}, {"low_at_bound", v.low_at_bound}, {"high_at_bound", v.high_at_bound}};
    }
  }
  return out;
}

/// The experiment that would best tell tied effects apart; its profile is null where none of the menu can.
json next_json(const Diagnosis& d) {
  if (d.next.empty()) return nullptr;
  const Proposal& best = d.next.front();
  const auto tied = std::ranges::find_if(d.missing, [](const MissingEffect& m) { return !m.tied_with.empty(); });
  json separates = json::array({d.id(tied->effect)});
  for (const std::size_t rival : tied->tied_with) separates.push_back(d.id(rival));
  json record = json::array();
  for (const Signal signal : best.record) record.push_back(info(signal).column);
  json knots = json::array();
  for (const Knot& knot : best.profile.knots()) knots.push_back({knot.t, knot.value});
  const bool worth = best.separation >= worth_an_experiment;
  return {{"profile", worth ? json(best.profile.name()) : json(nullptr)},
          {"what", worth ? best.what : "nothing on this bench can tell them apart"},
          {"record", worth ? record : json::array()},
          {"knots", worth ? knots : json::array()},
          {"separates", separates},
          {"separation", number_json(best.separation)}};
}

json to_json(const Diagnosis& d) {
  json out;
  out["verdict"] = word(d.verdict);
  out["missing"] = json::array();
  for (const MissingEffect& m : d.missing) {
    json tied = json::array(), parameters = json::object();
    for (const std::size_t rival : m.tied_with) tied.push_back(d.id(rival));
    for (std::size_t i = 0; i < m.parameters.size(); ++i) {
      const Parameter& p = m.parameters[i];
      parameters[p.symbol] = parameter_json(p);
      const std::vector<std::string> with = scaled_with(d.pins, full_name(d.about(m.effect), i));
      if (!with.empty()) parameters[p.symbol]["scaled_with"] = with;
    }
    out["missing"].push_back({{"id", d.id(m.effect)}, {"tied_with", tied}, {"parameters", parameters}});
    for (const OtherValue& other : m.otherwise)
      out["missing"].back()["otherwise"][d.id(other.effect)][other.name] = number_json(other.value);
  }
  out["candidates"] = json::array();
  for (const Candidate& c : d.candidates) {
    json expected = json::object();
    const EffectInfo& about = d.about(c.score.effect);
    for (std::size_t i = 0; i < c.score.expected().size(); ++i) {
      expected[std::string(about.parameters()[i].symbol)] = number_json(c.score.expected()[i]);
    }
    out["candidates"].push_back({{"id", d.id(c.score.effect)},
                                 {"predicted_drop", number_json(c.score.predicted_drop)},
                                 {"visibility", number_json(c.score.visibility)},
                                 {"p_value", number_json(c.score.p_value)},
                                 {"held_out_error", number_json(c.held_out_error)},
                                 {"detectable_size", number_json(c.score.detectable_size)},
                                 {"expected", expected}});
    if (!c.implausible.empty()) out["candidates"].back()["implausible"] = c.implausible;
  }
  out["not_tried"] = json::array();
  for (const Withheld& w : d.withheld) out["not_tried"].push_back({{"id", d.id(w.effect)}, {"why", w.why}});
  out["parameters"] = parameters_json(d.final, {}, d.pins);
  out["error"] = {{"base", {{"train", number_json(d.base_train)}, {"held_out", number_json(d.base_held_out)}}},
                  {"final", {{"train", number_json(d.final_train)}, {"held_out", number_json(d.final_held_out)}}}};
  out["signals"] = to_json(d.signals);
  out["steps"] = json::array();
  for (const Step& s : d.steps) {
    out["steps"].push_back({{"added", s.added ? json(d.id(*s.added)) : json(nullptr)},
                            {"action", s.action},
                            {"train", number_json(s.train)},
                            {"held_out", number_json(s.held_out)}});
  }
  out["unexplained"] = number_json(d.final_held_out);
  out["cut"] = d.cut;
  out["shown_by"] = d.shown_by;
  out["fitted_too"] = d.fitted_too;
  out["timing"] = timing_json(d.data->timing, d.data->interval(), d.final);
  out["where"] = maps_json(d.where);
  out["where_final"] = maps_json(d.where_final);
  out["missing_curves"] = {{"base", curves_json(d.missing_base)}, {"final", curves_json(d.missing_final)}};
  out["at_bound"] = d.at_bound;
  out["undetermined"] = undetermined_json(d.undetermined);
  if (!d.undetermined.empty()) {
    out["advice"] = advice_on(d.undetermined, d.final, recorded_by(d.data->train));
  }
  out["pins"] = pins_json(d.pins);
  out["held_out"] = d.judged_on_training ? "none"
                    : d.left_one_out     ? "each run in turn"
                    : d.training_judges  ? "named, and each training run in turn"
                                         : "named";
  out["next_experiment"] = next_json(d);
  return out;
}

json to_json(const Comparison& c, const Model& model) {
  json out;
  out["error"] = {{"staged", c.error}, {"chained", c.chained_error}};
  out["signals"] = to_json(c.signals);
  for (const auto& [signal, floors] : c.chained) out["signals"][name(signal)]["chained_floors"] = floors;
  out["timing"] = timing_json(c.timing, c.interval, model);
  out["failing_unit"] = c.failing_unit ? json(name_of(*c.failing_unit)) : json(nullptr);
  out["where"] = maps_json(c.where);
  return out;
}

json rounds_json(const Investigation& investigation) {
  json list = json::array();
  for (const InvestigationRound& r : investigation.rounds) {
    json missing = json::array();
    for (const InvestigationRound::Named& m : r.missing) missing.push_back({{"id", m.id}, {"tied_with", m.tied_with}});
    list.push_back({{"verdict", word(r.verdict)},
                    {"missing", missing},
                    {"base", r.base},
                    {"final", r.final},
                    {"sessions", r.sessions}});
  }
  return list;
}

json foretold_json(const Investigation& investigation) {
  if (!investigation.foretold) return nullptr;
  const ForetoldRun& foretold = *investigation.foretold;
  const auto errors = [](const Comparison& c) { return json{{"error", c.error}, {"chained_error", c.chained_error}}; };
  return {{"profile", to_yaml(foretold.profile)},
          {"prediction", foretold.prediction},
          {"session", foretold.recording.name},
          {"base", errors(foretold.base)},
          {"final", errors(foretold.final)}};
}

void write_json(const std::string& file, const json& value) {
  if (file.empty()) return;
  if (file == "-") {
    std::cout << value.dump(2) << "\n";
    return;
  }
  std::ofstream out(file);
  out << value.dump(2) << "\n";
  if (!out.flush()) throw Error(file + ": cannot be written. Give another --json FILE");
}

}  // namespace emtb
