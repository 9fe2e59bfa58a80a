#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/compare.h"
#include "analysis/diagnose/overlay.h"
#include "analysis/fit/starts.h"
#include "analysis/fit/timing.h"
#include "config/model.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "report/figures_of_diagnosis.h"
#include "report/rest_words.h"
#include "report/result_json.h"
#include "report/text.h"
#include "report/words.h"
#include "session/gaps.h"
#include "tools/model/model_options.h"
#include "tools/model/model_tables.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

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

}  // namespace

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
  o.finish_model(model);
  if (std::isfinite(c.error)) return 0;
  std::cerr
      << "emtb: the error is no number: the simulation leaves all bounds. Calibrate the model, or see emtb check\n";
  return 1;
}

}  // namespace emtb
