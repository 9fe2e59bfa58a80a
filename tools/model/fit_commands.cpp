#include <cmath>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/moves.h"
#include "analysis/diagnose/plausibility.h"
#include "analysis/diagnose/refit.h"
#include "analysis/diagnose/score.h"
#include "analysis/fit/profile_likelihood.h"
#include "analysis/fit/timing.h"
#include "config/model.h"
#include "hal/error.h"
#include "report/gauge_words.h"
#include "report/rest_words.h"
#include "report/result_json.h"
#include "report/words.h"
#include "tools/model/model_options.h"
#include "tools/model/model_tables.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

/// Of each effect that is there with values that no such machine has: what they are, and where its range ends.
std::vector<std::string> implausible_values(std::span<const Record> records, const Model& fitted) {
  std::vector<std::string> all;
  for (const IncludedEffect& e : fitted.effects) {
    if (!has_size(e.effect, fitted)) continue;
    const std::string said = implausible_value(records, fitted, e.effect);
    if (!said.empty()) all.push_back(std::string(fitted.about(e.effect).id) + ": " + said);
  }
  return all;
}

/// Fits, reports, writes: what calibrate and add have in common.
int fit_and_report(const ModelOptions& o, const Model& start, Dataset& data, const std::string& action, json extra) {
  Calibration c = calibrate(data, start, o.calibration());
  HistoryEntry entry{action, error_on(data.train, c.model), {}, o.sessions};
  if (!data.held_out.empty()) entry.held_out = error_on(data.held_out, c.model);
  const bool blows_up = entry.held_out && !std::isfinite(*entry.held_out);
  if (blows_up) entry.held_out.reset();  // it is no number, so it stands nowhere as one
  c.model.history.push_back(entry);
  json out = std::move(extra);
  out["converged"] = c.converged;
  const LikelihoodIntervals intervals =
      o.intervals ? profile_likelihoods(data.train, c, o.calibration()) : LikelihoodIntervals{};
  out["parameters"] = parameters_json(c.model, intervals);
  out["error"] = {{"train", *entry.train}, {"held_out", entry.held_out ? json(*entry.held_out) : json(nullptr)}};
  out["at_bound"] = c.at_bound;
  out["undetermined"] = json::array();
  for (const Undetermined& u : c.identifiability.undetermined) out["undetermined"].push_back(u.combination);
  out["advice"] = c.identifiability.undetermined.empty()
                      ? json(nullptr)
                      : json(advice_on(c.identifiability.undetermined, c.model, recorded_by(data.train)));
  const std::vector<std::string> implausible = implausible_values(data.train, c.model);
  out["implausible"] = implausible;
  out["singular_values"] =
      std::vector<double>(c.identifiability.singular_values.begin(), c.identifiability.singular_values.end());
  out["signals"] = to_json(fit_of(data.held_out.empty() ? data.train : data.held_out, c.model, data.noise));
  out["timing"] = timing_json(data.timing, data.interval(), c.model);
  write_json(o.json_file, out);
  if (blows_up) {
    std::cerr << "emtb: with the fitted parameters the simulation of a held-out run leaves all bounds: its error is no "
                 "number. The model does not hold there: add sessions like it to the training, or another effect\n";
  }
  if (o.json_file == "-") return c.converged && !blows_up ? 0 : 1;
  print_parameters(c.model, c.at_bound, c.identifiability.undetermined, data.train, intervals);
  std::cout << "error (1 = noise floor): training " << error_cell(entry.train) << ", held-out "
            << error_cell(entry.held_out) << "\ntiming: " << in_words(data.timing, data.interval(), c.model) << "\n";
  o.finish_model(c.model);
  for (const std::string& said : implausible) {
    std::cerr << "emtb: " << said << ". What these runs show is hardly this effect\n";
  }
  constexpr double clearly = 1.02;  // times what was left before
  if (out.contains("before") && *entry.train > clearly * out["before"]["train"].get<double>())
    std::cerr << "emtb: the model leaves more with it than without: it is not this, or its fit went astray. Give its "
                 "parameters values and bounds in the model, and calibrate\n";
  if (!c.converged)
    std::cerr << "emtb: the fit did not converge: start nearer, or fix what the data do not determine\n";
  return c.converged && !blows_up ? 0 : 1;
}

}  // namespace

int calibrate_command(const ModelOptions& o) {
  const Model model = read_model(o.model);
  const auto runs = o.checked_runs(model);
  if (!runs) return 1;
  Dataset data = prepare(runs->train, runs->held_out, model);
  return fit_and_report(o, model, data, "calibrated", json::object());
}

int add_command(const ModelOptions& o) {
  const Model model = o.model_with_candidates();
  const std::size_t effect = model.effect_named(o.effect);
  if (model.includes(effect)) throw Error(o.model + " includes " + o.effect + " already. Use emtb calibrate");
  const auto runs = o.checked_runs(model);
  if (!runs) return 1;
  Dataset data = prepare(runs->train, runs->held_out, model);
  const Calibration before = calibrate(data, model);
  Model with_it = model;
  with_it.include(effect);
  const auto error_before = [&](std::span<const Record> on) { return error_on(on, before.model, with_it); };
  json extra{{"added", o.effect}};
  extra["before"] = {{"train", error_before(data.train)},
                     {"held_out", data.held_out.empty() ? json(nullptr) : json(error_before(data.held_out))}};
  if (o.json_file != "-") {
    std::cout << "without " << o.effect << ": training " << error_cell(extra["before"]["train"].get<double>())
              << ", held-out " << (data.held_out.empty() ? "-" : error_cell(extra["before"]["held_out"].get<double>()))
              << "\n";
  }
  const Fit begun = begun_refit_with(data.train, before, model, effect);
  if (!std::isfinite(begun.cost)) {
    throw Error(o.model + " cannot be simulated with " + o.effect + ": the result is not finite");
  }
  return fit_and_report(o, begun.model, data, "added " + o.effect, extra);
}

}  // namespace emtb
