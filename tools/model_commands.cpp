#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/diagnose.h"
#include "analysis/diagnose/overlay.h"
#include "analysis/diagnose/refit.h"
#include "analysis/diagnose/score.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/profile_likelihood.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "config/formula_effect.h"
#include "config/mapping.h"
#include "config/model.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/unit.h"
#include "model/catalogue.h"
#include "report/answer.h"
#include "report/discovery_json.h"
#include "report/discovery_words.h"
#include "report/figures_of_diagnosis.h"
#include "report/gauge_words.h"
#include "report/progress.h"
#include "report/rest_words.h"
#include "report/result_json.h"
#include "report/symbols.h"
#include "report/text.h"
#include "report/verdict.h"
#include "report/words.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/checked.h"
#include "tools/commands.h"
#include "tools/discover_rest.h"
#include "tools/offered_words.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

/// Runs that a model is fitted to, and those that judge, without a gap in what drives it.
struct CheckedRuns {
  std::vector<Run> train, held_out;
};

struct ModelOptions {
  std::string effect, model;
  std::vector<std::string> sessions, held_out, outputs;
  std::string map, out, json_file, candidates;
  Wanted wanted;
  SearchWords search;
  bool fit = false, plot = false, every_candidate = false, intervals = false, unchecked = false;

  std::vector<Run> runs(const std::vector<std::string>& specs) const {
    auto all = read_runs(specs, map.empty() ? Mapping{} : read_mapping(map));
    refuse_slow_readings(all);
    return all;
  }

  KeptAnswers::Files files() const {
    return {files_read({model, map, candidates}, sessions, held_out), files_written({json_file, out})};
  }

  /// Those that fit and those that judge; nothing where a finding stops it.
  std::optional<CheckedRuns> checked_runs(const Model& m) const {
    const CheckedRuns given{runs(sessions), runs(held_out)};
    if (!may_be_fitted(given.train, given.held_out, m, unchecked, json_file == "-" ? std::cerr : std::cout)) return {};
    return CheckedRuns{split_at_gaps(given.train, m.input), split_at_gaps(given.held_out, m.input)};
  }

  /// The model, with the formulas of the user that it may be given.
  Model model_with_candidates() const {
    Model m = read_model(model);
    if (!candidates.empty()) offer(m, candidates);
    return m;
  }

  CalibrationOptions calibration() const {
    CalibrationOptions options;
    for (const std::string& name : outputs) {
      const auto signal = signal_named(name);
      if (!signal) throw Error("--outputs " + name + ": no such signal. Known: omega, i_a, e_a, torque");
      options.outputs.push_back(*signal);
    }
    return options;
  }
};

/// Of the noise floor, whose own digits end there.
std::string error_cell(std::optional<double> error) { return error ? pretty(*error, 3) : "-"; }

std::string in_words(const LikelihoodInterval& v) {
  return (v.low_at_bound ? "(bound) " : "") + pretty(v.low, 4) + " to " + pretty(v.high, 4) +
         (v.high_at_bound ? " (bound)" : "");
}

/// Values with standard errors, what rests on a bound, what the data do not determine.
/// @param intervals where they were asked for
void print_parameters(const Model& model, const std::vector<std::string>& at_bound,
                      const std::vector<Undetermined>& undetermined, std::span<const Record> records,
                      const LikelihoodIntervals& intervals, std::span<const Pin> pins = {}) {
  std::vector<std::string> heading{"parameter", "value", "+- std error", "unit", ""};
  if (!intervals.empty()) heading.insert(heading.end() - 1, "95 % by profile likelihood");
  Table table(heading);
  const std::vector<std::string> names = model.names();
  const std::vector<double> values = model.values();
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Parameter& p = model.at(i);
    const auto tie = model.tie.find(names[i]);
    std::string remark;
    if (tie != model.tie.end()) {
      remark = "= " + tie->second;
    } else if (p.pinned) {
      remark = "held: see below";
    } else if (p.fixed) {
      remark = "fixed";
    } else if (std::ranges::find(at_bound, names[i]) != at_bound.end()) {
      remark = "rests on its bound";
    }
    const bool free = remark.empty();
    if (const auto with = scaled_with(pins, tie != model.tie.end() ? tie->second : names[i]); !with.empty()) {
      remark += (remark.empty() ? "" : ", ") + ("goes with " + joined(with));
    }
    std::vector<std::string> row{names[i], pretty(values[i], free && !is_determined(p) ? 2 : 5),
                                 error_in_words(p, free), shown_unit(p.unit)};
    if (!intervals.empty()) {
      const auto interval = intervals.find(names[i]);
      row.push_back(interval == intervals.end() ? "" : in_words(interval->second));
      if (interval != intervals.end() && remark.empty() && misled(p, interval->second)) {
        remark = "the standard error misleads";
      }
    }
    row.push_back(remark);
    table.row(row);
  }
  std::cout << table.text("", width_of_rows());
  for (const Pin& pin : pins) std::cout << fitted(in_words(pin), width_of_prose());
  for (const Undetermined& u : undetermined) std::cout << fitted(in_words(u), width_of_prose());
  if (!undetermined.empty()) {
    std::cout << fitted("To determine " + std::string(undetermined.size() == 1 ? "it" : "them") + ": " +
                            advice_on(undetermined, model, recorded_by(records)),
                        width_of_prose());
  }
}

/// The most telling map of each signal that is above its floor.
void print_where(const std::vector<ResidualMap>& maps, const std::map<Signal, SignalFit>& signals) {
  std::vector<Signal> shown;
  for (const ResidualMap& m : maps) {
    const auto fit = signals.find(m.signal);
    if (fit == signals.end() || fit->second.ratio < above_the_floor || m.against == Condition::time ||
        m.against == Condition::direction)
      continue;
    if (std::ranges::find(shown, m.signal) != shown.end() || m.bins.size() < 3) continue;
    shown.push_back(m.signal);
    double largest = 0;
    for (const double mean : m.mean) largest = std::max(largest, std::abs(mean));
    std::cout << "\n"
              << info(m.signal).name << ", measured - simulated [" << info(m.signal).unit << "], against "
              << name_of(m.against) << " (explains " << pretty(100 * m.explained, 2) << " % of the residual)\n";
    Table table({std::string(name_of(m.against)), "mean", "", "RMSE/floor"});
    for (std::size_t b = 0; b < m.bins.size(); ++b) {
      table.row({pretty(m.bins[b], 3), pretty(m.mean[b], 3), bar(largest > 0 ? m.mean[b] / largest : 0, 40),
                 pretty(m.ratio[b], 3)});
    }
    std::cout << table.text("  ", width_of_rows());
  }
  if (shown.empty()) std::cout << "No signal is above its noise floor by more than a tenth.\n";
}

void finish_model(const ModelOptions& o, const Model& model) {
  if (o.out.empty()) return;
  write_model(o.out, model);
  std::cout << "written: " << o.out << "\n";
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
  out["singular_values"] =
      std::vector<double>(c.identifiability.singular_values.begin(), c.identifiability.singular_values.end());
  out["signals"] = to_json(fit_of(data.held_out.empty() ? data.train : data.held_out, c.model, data.noise));
  write_json(o.json_file, out);
  if (blows_up) {
    std::cerr << "emtb: with the fitted parameters the simulation of a held-out run leaves all bounds: its error is no "
                 "number. The model does not hold there: add sessions like it to the training, or another effect\n";
  }
  if (o.json_file == "-") return c.converged && !blows_up ? 0 : 1;
  print_parameters(c.model, c.at_bound, c.identifiability.undetermined, data.train, intervals);
  std::cout << "error (1 = noise floor): training " << error_cell(entry.train) << ", held-out "
            << error_cell(entry.held_out) << "\n";
  finish_model(o, c.model);
  constexpr double clearly = 1.02;  // times what was left before
  if (out.contains("before") && *entry.train > clearly * out["before"]["train"].get<double>())
    std::cerr << "emtb: the model leaves more with it than without: it is not this, or its fit went astray. Give its "
                 "parameters values and bounds in the model, and calibrate\n";
  if (!c.converged)
    std::cerr << "emtb: the fit did not converge: start nearer, or fix what the data do not determine\n";
  return c.converged && !blows_up ? 0 : 1;
}

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

/// The signal that is furthest off, in the run where it is: measured over simulated with the residual below. Where none
/// is off, the speed.
void plot_worst(std::span<const Run> runs, const Model& model) {
  Dataset data = prepare(runs, {}, model);
  settle_timing(data, model);
  settle_starts(data, model);
  std::optional<Overlay> worst;
  std::string name;
  const auto off = [](const Overlay& o) {
    const double floors = o.floors();
    return floors > above_the_floor ? floors : o.signal == Signal::omega ? 1 : 0;
  };
  for (const Record& record : data.train) {
    for (Overlay& o : overlays(record, model)) {
      if (worst && off(o) <= off(*worst)) continue;
      worst = std::move(o);
      name = short_name(record.name);
    }
  }
  if (worst) std::cout << "\n" << to_terminal(overlay_figure(name, *worst).figure, style_of_stdout());
}

bool is_model_file(const std::string& argument) { return argument.ends_with(".yaml") || argument.ends_with(".yml"); }

/// Several models on the same runs, weighed alike: the error of each, signal by signal.
int compare_models(const ModelOptions& o, const std::vector<std::string>& files,
                   const std::vector<std::string>& sessions) {
  if (sessions.empty()) throw Error("compare needs a SESSION behind the models: a .csv, .h5 or .mat");
  if (!o.out.empty()) throw Error("compare writes no model where it compares several: leave --out away");
  std::vector<Model> models;
  for (const std::string& file : files) models.push_back(read_model(file));
  const std::vector<Run> train = o.runs(sessions);
  const std::vector<Run> held_out = o.runs(o.held_out);
  const Model given = models.front();
  if (o.fit) {
    for (Model& model : models) {
      Dataset data = prepare(train, held_out, model);
      model = calibrate(data, model, o.calibration()).model;
    }
  }
  const std::vector<Run>& runs = held_out.empty() ? train : held_out;
  std::vector<Comparison> results;
  for (const Model& model : models) {
    results.push_back(held_out.empty() ? compare(runs, model, models.front()) : compare(runs, model, given, train));
  }
  json out = json::object();
  out["models"] = json::array();
  for (std::size_t i = 0; i < models.size(); ++i) {
    json one{{"file", files[i]}, {"name", models[i].name}};
    one.update(to_json(results[i], models[i]));
    out["models"].push_back(std::move(one));
  }
  write_json(o.json_file, out);
  if (o.json_file == "-") return 0;
  std::vector<std::string> heading{"multiples of the noise floor"};
  for (const std::string& file : files) heading.push_back(std::filesystem::path(file).stem().string());
  Table table(heading);
  const auto row = [&](const std::string& what, const auto& get) {
    std::vector<std::string> cells{what};
    for (const Comparison& c : results) cells.push_back(error_cell(get(c)));
    table.row(cells);
  };
  row("error", [](const Comparison& c) { return c.error; });
  row("all units chained", [](const Comparison& c) { return c.chained_error; });
  for (const auto& [signal, fit] : results.front().signals) {
    row(std::string(info(signal).name) + " (floor " + pretty(fit.noise.sigma, 3) + " " +
            std::string(info(signal).unit) + ")",
        [&](const Comparison& c) { return c.signals.at(signal).ratio; });
  }
  std::cout << models.size() << " models on " << counted(runs.size(), held_out.empty() ? "run" : "held-out run") << "\n"
            << table.text("", width_of_rows());
  const auto best = std::ranges::min_element(results, {}, &Comparison::error);
  std::cout << "nearest to the measurements: " << files[static_cast<std::size_t>(best - results.begin())] << "\n";
  return 0;
}

int compare_command(const ModelOptions& o) {
  const auto others = std::ranges::partition_point(o.sessions, is_model_file);
  if (others != o.sessions.begin()) {
    std::vector<std::string> files{o.model};
    files.insert(files.end(), o.sessions.begin(), others);
    return compare_models(o, files, {others, o.sessions.end()});
  }
  Model model = read_model(o.model);
  const std::vector<Run> train = split_at_gaps(o.runs(o.sessions), model.input);
  const std::vector<Run> held_out = split_at_gaps(o.runs(o.held_out), model.input);
  const Model given = model;
  if (o.fit) {
    Dataset data = prepare(train, held_out, model);
    model = calibrate(data, model, o.calibration()).model;
  }
  const std::vector<Run>& runs = held_out.empty() ? train : held_out;  // what is compared: runs that no fit has seen
  const Comparison c = held_out.empty() ? compare(runs, model) : compare(runs, model, given, train);
  write_json(o.json_file, to_json(c, model));
  if (o.json_file == "-") return 0;
  std::cout << "model `" << model.name << "` on " << counted(runs.size(), held_out.empty() ? "run" : "held-out run")
            << ": error " << error_cell(c.error) << " (1 = noise floor), all units chained "
            << error_cell(c.chained_error) << "\n";
  std::cout << signals_text(c.signals, c.chained) << "timing: " << in_words(c.timing, c.interval, model) << "\n";
  if (c.failing_unit) std::cout << "The unit that fails: " << name_of(*c.failing_unit) << "\n";
  print_where(c.where, c.signals);
  if (o.plot || isatty(STDOUT_FILENO) == 1) plot_worst(runs, model);
  finish_model(o, model);
  if (std::isfinite(c.error)) return 0;
  std::cerr
      << "emtb: the error is no number: the simulation leaves all bounds. Calibrate the model, or see emtb check\n";
  return 1;
}

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
  finish_model(o, d.final);
  std::cout << answer_text(d, {o.model, o.sessions, o.held_out, o.map, o.candidates, o.out});
  return 0;
}

}  // namespace

void add_model_commands(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers) {
  const auto o = std::make_shared<ModelOptions>();
  const auto on_files = [&](Command command) {
    command.argument("MODEL", o->model, "the model's YAML")
        .arguments("SESSION", o->sessions,
                   "PATH[#RUN][@T0:T1], .csv, .h5 or .mat: what the model is fitted to or compared with")
        .options("--held-out", o->held_out, "sessions that judge the fit and take no part in it")
        .option("--map", o->map, "how the columns of foreign CSV files become signals")
        .option("--out", o->out, "writes the resulting model here; a MODEL is never overwritten otherwise")
        .option("--json", o->json_file, "writes the result to this file; - for standard output")
        .options("--outputs", o->outputs, "fits to these signals alone: omega, i_a, e_a, torque")
        .offers(signal_names);
    return command;
  };
  const auto with_intervals = [&](Command command) {
    return command.flag("--intervals", o->intervals,
                        "95 % intervals by profile likelihood: right also at a bound and where effects are not linear");
  };
  const auto looking_first = [&](Command command) { return command.flag("--unchecked", o->unchecked, unchecked_help); };
  const auto act = [&](int (*command)(const ModelOptions&)) {
    return [o, answers, command] { return answers->answer(o->files(), [&] { return command(*o); }); };
  };
  looking_first(with_intervals(on_files(
                    line.command("calibrate", "fits the free parameters of a model to sessions, within their bounds"))))
      .action(act(calibrate_command));
  on_files(
      line.command(
          "compare",
          "compares a model with measurements and shows where it fails; or several: compare A.yaml B.yaml SESSION..."))
      .flag("--fit", o->fit, "fits the model to the sessions first")
      .flag("--plot", o->plot, "draws the signal that is furthest off, also where the output is no terminal")
      .action(act(compare_command));
  const char* const candidates = "a YAML file of formulas of your own, to be tried beside the library's effects";
  looking_first(
      with_intervals(on_files(line.command("diagnose", "finds out which physical effect a model is missing"))))
      .option("--candidates", o->candidates, candidates)
      .options("--only", o->wanted.only, only_help)
      .offers(effect_ids)
      .options("--without", o->wanted.without, without_help)
      .offers(effect_ids)
      .option("--effort", o->search.effort, effort_help)
      .option("--explain", o->search.explain, explain_help)
      .one_of({"torque"})
      .flag("--all", o->every_candidate, "shows every candidate, not only the best five")
      .action(act(diagnose_command));
  Command add = line.command("add", "adds an effect to a model, fits it, and shows what it brought");
  add.argument("EFFECT", o->effect, "its id: see emtb effects; or that of a formula in --candidates")
      .offers(effect_ids);
  looking_first(with_intervals(on_files(add)))
      .option("--candidates", o->candidates, candidates)
      .action(act(add_command));
}

}  // namespace emtb
