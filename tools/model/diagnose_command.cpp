#include <algorithm>
#include <cmath>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/diagnose.h"
#include "analysis/fit/profile_likelihood.h"
#include "report/answer.h"
#include "report/discovery_json.h"
#include "report/discovery_words.h"
#include "report/progress.h"
#include "report/rest_words.h"
#include "report/result_json.h"
#include "report/text.h"
#include "report/verdict.h"
#include "report/words.h"
#include "tools/discover_rest.h"
#include "tools/model/model_options.h"
#include "tools/model/model_tables.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

/// The error from step to step, as bars.
void print_steps(const Diagnosis& d) {
  double largest = 1;
  for (const Step& s : d.steps) largest = std::max(largest, s.held_out);  // no number is none larger
  Table steps({"error (1 = noise floor)", "training", "held-out", ""});
  for (const Step& s : d.steps) {
    const double share = std::isfinite(s.held_out) ? s.held_out / largest : 1;
    const auto length = static_cast<std::size_t>(std::lround(50 * share));
    steps.row({s.action, error_cell(s.train), error_cell(s.held_out),
               std::string(length, '#') + std::string(50 - length, ' ')});
  }
  std::cout << steps.text("", width_of_rows());
}

/// What was tried, best first.
void print_candidates(const Diagnosis& d, bool all) {
  constexpr std::size_t few = 5;
  std::cout << candidates_text(d, all ? 0 : few, width_of_prose());
  for (const auto& list : {refused(d), not_tried(d)}) {
    for (const std::string& line : list) std::cout << wrapped(line, width_of_prose()) << "\n";
  }
}

}  // namespace

int diagnose_command(const ModelOptions& o) {
  DiagnoseOptions options = o.search.options();
  Model model = o.model_with_candidates();
  withhold_unwanted(model, o.wanted);
  const auto runs = o.checked_runs(model);
  if (!runs) return 1;
  const std::vector<Run>&train = runs->train, &held_out = runs->held_out;
  Progress progress;
  options.progress = [&](double share, const std::string& doing) { progress.show(share, doing); };
  Diagnosis d = diagnose(train, held_out, model, options);
  const std::unique_ptr<Discovery> rest = discover_rest(d, train, held_out);
  progress.clear();
  for (const Step& s : d.steps) d.final.history.push_back({s.action, s.train, s.held_out, o.sessions});
  json result = to_json(d);
  if (rest) result["discovered"] = to_json(*rest);
  LikelihoodIntervals intervals;
  if (o.intervals) {
    CalibrationOptions from_there;
    from_there.extra_starts = 0;
    intervals = profile_likelihoods(d.data->train, calibrate(d.data->train, d.final, from_there));
    result["parameters"] = parameters_json(d.final, intervals, d.pins);
  }
  write_json(o.json_file, result);
  if (o.json_file == "-") return 0;

  std::cout << "model `" << model.name << "`, " << counted(train.size(), "training run") << " and "
            << counted(held_out.size(), "held-out run")
            << (d.left_one_out         ? ": each run held out in turn"
                : d.judged_on_training ? ": one run, judged on itself"
                                       : "")
            << "\n\n";
  print_steps(d);
  if (d.verdict != Verdict::nothing_missing && d.verdict != Verdict::cannot_tell) {
    std::cout << "\nWhere the model as given fails:";
    std::map<Signal, SignalFit> all_above;  // the maps choose themselves: show those of every signal of the base model
    for (const ResidualMap& m : d.where) all_above[m.signal].ratio = *std::ranges::max_element(m.ratio);
    print_where(d.where, all_above);
  }
  std::cout << "\n";
  print_candidates(d, o.every_candidate);
  std::cout << "\n";
  print_parameters(d.final, d.at_bound, d.undetermined, d.data->train, intervals, d.pins);
  std::cout << "\n"
            << fitted(signals_text(d.signals) + "timing: " + in_words(d.data->timing, d.data->interval(), d.final) +
                          "\n\n" + verdict_text(d) + "\n",
                      width_of_prose());
  if (rest) std::cout << fitted(discovery_text(*rest), width_of_prose()) << "\n";
  o.finish_model(d.final);
  std::cout << answer_text(d, {o.model, o.sessions, o.held_out, o.map, o.candidates, o.out});
  return 0;
}

}  // namespace emtb
