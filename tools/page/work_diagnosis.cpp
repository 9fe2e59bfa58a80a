#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/next_experiment.h"
#include "analysis/diagnose/overlay.h"
#include "analysis/diagnose/refit.h"
#include "analysis/fit/rotor_phase.h"
#include "config/model.h"
#include "config/profile.h"
#include "hal/error.h"
#include "model/catalogue.h"
#include "report/discovery_json.h"
#include "report/discovery_words.h"
#include "report/report_page.h"
#include "report/result_json.h"
#include "report/text.h"
#include "report/verdict.h"
#include "server/rpc.h"
#include "tools/discover_rest.h"
#include "tools/page/numbers.h"
#include "tools/page/work.h"

namespace emtb::page {
namespace {

constexpr std::size_t most_signatures = 6;
constexpr std::size_t signature_points = 120;

/// What a candidate would do to the signal that is furthest off, over the residual, in the run where it is.
struct Worst {
  const Record* record = nullptr;
  Overlay overlay;
};

Worst worst_of(std::span<const Record> records, const Model& model) {
  Worst worst;
  for (const Record& record : records) {
    for (Overlay& o : overlays(record, model)) {
      if (worst.record != nullptr && o.floors() <= worst.overlay.floors()) continue;
      worst = {&record, std::move(o)};
    }
  }
  return worst;
}

json signature_of(const Worst& worst, const Model& with) {
  if (worst.record == nullptr) return nullptr;
  const Overlay& base = worst.overlay;
  for (const Overlay& o : overlays(*worst.record, with)) {
    if (o.signal != base.signal) continue;
    std::vector<double> effect(o.simulated.size());
    for (std::size_t i = 0; i < effect.size(); ++i) effect[i] = o.simulated[i] - base.simulated[i];
    const Bins bins = bins_of(base.t, {.from = base.t.front(), .to = base.t.back(), .points = signature_points});
    return {{"signal", info(base.signal).name},
            {"unit", info(base.signal).unit},
            {"against", "t"},
            {"x", numbers(bins.t)},
            {"residual", mean(bins, base.residual())},
            {"effect", mean(bins, effect)}};
  }
  return nullptr;
}

json values_of(const EffectInfo& about, std::span<const double> expected) {
  json value = json::object();
  for (std::size_t i = 0; i < std::min(expected.size(), about.parameter_count); ++i) {
    const EffectParameter& p = about.parameter_list[i];
    value[std::string(p.symbol)] = {{"value", number(expected[i])}, {"std_error", nullptr}, {"unit", p.unit}};
  }
  return value;
}

/// What a card of the page shows of a candidate, beside what the JSON of a diagnosis says.
void add_card(json& card, const Diagnosis& d, const Candidate& c, double squares, const Worst* worst) {
  const EffectInfo& about = d.about(c.score.effect);
  card["name"] = about.name;
  card["what"] = about.what;
  card["equation"] = about.equation;
  card["value"] = values_of(about, c.score.expected());
  card["drop_percent"] = squares > 0 ? number(100 * std::min(1.0, c.score.predicted_drop / squares)) : json(nullptr);
  for (const MissingEffect& m : d.missing) {
    if (m.effect != c.score.effect) continue;
    for (const Parameter& p : m.parameters) {
      card["value"][p.symbol] = {{"value", number(p.value)},
                                 {"std_error", p.std_error ? number(*p.std_error) : json(nullptr)},
                                 {"unit", p.unit}};
    }
  }
  if (worst == nullptr || c.score.starts.empty()) return;
  const auto begun = with_effect(d.data->train, d.base, squares, c.score.effect, c.score.starts.front());
  if (begun) card["signature"] = signature_of(*worst, begun->model);
}

/// The law as Work::add_formula() takes it.
json formula_of(const FormulaText& law) {
  json parameters = json::object();
  for (const FormulaText::Parameter& p : law.parameters) {
    parameters[p.symbol] = {{"value", number(p.value)},
                            {"min", number(p.min)},
                            {"max", number(p.max)},
                            {"unit", p.unit},
                            {"fixed", p.fixed}};
  }
  const std::string place = law.place == TermPlace::flux ? "flux" : name_of(law.place);
  json formula{{"id", law.id}, {"place", place}, {"formula", law.formula}, {"parameters", parameters}};
  if (!law.rate.empty()) formula["memory"] = {{"z", law.rate}};
  return formula;
}

/// What is left without a name: in words, and as a law to draw and to add.
json card_of(const Discovery& rest) {
  json card = to_json(rest);
  card["machine"] = machine_in_words(rest);
  card["law"] = nullptr;
  card["no_law"] = rest.law ? "" : no_law_in_words(rest);
  if (!rest.law) return card;
  card["law"] = card["laws"].front();
  card["law"]["add"] = formula_of(rest.law->text);
  return card;
}

}  // namespace

/// The model and the runs that a diagnosis is of.
std::string Work::question() const {
  std::string of = to_yaml(now_.model);
  for (const Run& run : train_) of += "\n" + run.name;
  for (const Run& run : held_out_) of += "\nheld out " + run.name;
  return of;
}

/// One floor has one number: errors are counted from now on in the floors, with the weights and the timing, that the
/// diagnosis counts in.
void Work::take_floors_of(const Diagnosis& d) {
  const auto sigma = [](const Noise::value_type& of) { return std::pair(of.first, of.second.sigma); };
  const bool same = std::ranges::equal(d.data->noise, data_.noise, {}, sigma, sigma);
  data_ = *d.data;
  if (same) return;
  quieter_ = data_.noise;
  count_steps_anew();
  save();
}

/// A diagnosis is of the model once fitted, and so is what stands beside it: a change like any other, with undo.
void Work::take_fit_of(const Diagnosis& d) {
  constexpr double visible = 1e-3;  // errors are shown with three digits
  const Step now = step_of("", now_.model);
  const auto near = [](double a, double b) { return !(std::abs(a - b) > visible * b); };
  if (near(now.train, d.base_train) && (data_.held_out.empty() || near(now.held_out, d.base_held_out))) return;
  State next = now_;
  for (std::size_t i = 0; i < next.model.names().size(); ++i) {
    Parameter& p = next.model.at(i);
    if (p.fixed) continue;
    p.value = d.base.at(i).value;
    p.std_error = d.base.at(i).std_error;
  }
  next.at_bound.clear();
  next.steps.back() = step_of(next.steps.back().added, next.model);
  next.model.history.push_back({"calibrated", next.steps.back().train, {}, train_specs_});
  change(std::move(next), "fit");
}

const Diagnosis& Work::diagnosis(const Progress& progress) {
  refuse_unless_fit_for_fitting();
  const std::string of = question();
  if (diagnosis_ && diagnosed_ == of) return *diagnosis_;
  DiagnoseOptions options;
  options.progress = [&](double share, const std::string& doing) { progress(0.9 * share, doing); };
  diagnosis_ = std::make_unique<Diagnosis>(emtb::diagnose(train_, held_out_, now_.model, options));
  progress(0.9, "looking into what is left");
  rest_ = discover_rest(*diagnosis_, train_, held_out_);
  diagnosed_ = of;
  take_floors_of(*diagnosis_);
  return *diagnosis_;
}

json Work::diagnose(const Progress& progress) {
  const Diagnosis& d = diagnosis([&](double share, const std::string& doing) { progress(0.95 * share, doing); });
  take_fit_of(d);
  diagnosed_ = question();
  progress(0.95, "drawing what the candidates would do");
  json out = to_json(d);
  const double squares = squares_at_best_phases(d.data->train, d.base).squares;
  const Worst worst = worst_of(d.data->train, d.base);
  for (std::size_t i = 0; i < d.candidates.size(); ++i) {
    add_card(out["candidates"][i], d, d.candidates[i], squares, i < most_signatures ? &worst : nullptr);
  }
  for (std::size_t i = 0; i < d.missing.size(); ++i) out["missing"][i]["name"] = d.about(d.missing[i].effect).name;
  out["verdict_text"] = verdict_in_words(d);
  if (rest_) out["discovered"] = card_of(*rest_);
  if (!d.next.empty()) {
    out["next_experiment"]["why"] = in_words(d.next.front());
    if (out["next_experiment"]["profile"].is_string()) out["next_experiment"]["text"] = to_yaml(d.next.front().profile);
  }
  out["work"] = state();
  return out;
}

json Work::report(const Progress& progress) {
  ReportInput in = ReportInput::of(files_.model, now_.model, files_.command);
  in.map_file = files_.map;
  for (const bool judges : {false, true}) {
    for (const std::string& spec : judges ? held_out_specs_ : train_specs_) in.add(spec, judges, mapping_);
  }
  in.split_at_gaps();
  if (!findings_.empty()) return {{"html", refusal_page(in, findings_).html()}};
  const Diagnosis& d = diagnosis([&](double share, const std::string& doing) { progress(0.9 * share, doing); });
  in.discovery = rest_.get();
  progress(0.92, "drawing");
  return {{"html", report_page(in, d).html()}};
}

json Work::score_formula(const json& formula) const {
  const Model model = with_formula(formula);
  const std::size_t effect = effect_count;  // the first that is on offer
  const double squares = squares_at_best_phases(data_.train, model).squares;
  const std::vector<Score> scores = score(data_.train, model, std::span(&effect, 1));
  if (scores.empty() || scores.front().starts.empty()) throw Error("these runs say nothing of it");
  const Score& s = scores.front();
  const auto begun = with_effect(data_.train, model, squares, effect, s.starts.front());
  if (!begun) throw Error("with it the model cannot be simulated: it leaves all bounds");
  const Fit fit = first_steps(data_.train, begun->model, 2, begun->phases);
  const auto pair = [&](std::span<const Record> records) {
    if (records.empty()) return json(nullptr);
    return json{{"before", number(error_on(records, model))}, {"after", number(error_on(records, fit.model))}};
  };
  json parameters = json::object();
  for (const Parameter& p : fit.model.parameters_of(effect)) {
    parameters[p.symbol] = {{"value", number(p.value)}, {"std_error", nullptr}, {"unit", p.unit}};
  }
  const double drop = squares > 0 ? 100 * std::min(1.0, s.predicted_drop / squares) : 0;
  return {
      {"train", pair(data_.train)},
      {"held_out", pair(data_.held_out)},
      {"parameters", parameters},
      {"predicted_drop", number(s.predicted_drop)},
      {"p_value", number(s.p_value)},
      {"visibility", number(s.visibility)},
      {"text", "To first order it takes away " + pretty(drop, 3) +
                   " % of the sum of squares that the model leaves; the errors are those after two steps of a fit."}};
}

}  // namespace emtb::page
