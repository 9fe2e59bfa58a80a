#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/diagnose.h"
#include "analysis/discover/discover.h"
#include "analysis/discover/trends.h"
#include "analysis/fit/gauge.h"
#include "analysis/fit/timing.h"
#include "config/mapping.h"
#include "config/model.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/unit.h"
#include "report/discovery_figures.h"
#include "report/discovery_json.h"
#include "report/discovery_words.h"
#include "report/progress.h"
#include "report/result_json.h"
#include "report/text.h"
#include "report/words.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/checked.h"
#include "tools/commands.h"
#include "tools/discover_rest.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct DiscoverArguments {
  std::string model, map, out, svg, json_file;
  std::vector<std::string> sessions, held_out;
  bool unchecked = false;

  std::vector<Run> runs(const std::vector<std::string>& specs) const {
    auto all = read_runs(specs, map.empty() ? Mapping{} : read_mapping(map));
    refuse_slow_readings(all);
    return all;
  }

  KeptAnswers::Files files() const {
    return {files_read({model, map}, sessions, held_out), files_written({json_file, out, svg})};
  }
};

void print_shares(const Shares& s, const std::string& what, const std::string& unit) {
  if (s.of.empty()) return;
  std::cout << "\nThe missing " << what << ", " << pretty(s.rms, 3) << " " << unit
            << " rms. Of its mean square, on runs left out, a smooth function explains [%]:\n";
  Table table({"of", "alone", "+-", "what only it explains"});
  std::vector<std::pair<std::string, Share>> list(s.of.begin(), s.of.end());
  std::ranges::stable_sort(list, [](const auto& a, const auto& b) { return a.second.alone > b.second.alone; });
  const auto percent = [](double share) { return pretty(std::round(100 * std::max(0.0, share)), 3); };
  for (const auto& [name, share] : list) {
    table.row({name, percent(share.alone), percent(share.std_error), percent(share.only)});
  }
  table.row({"all together", percent(s.together), "", ""});
  std::cout << table.text("  ", width_of_rows());
}

/// The verdict of a diagnosis on these runs, in a line.
std::string verdict_on(std::span<const Run> train, std::span<const Run> held_out, const Model& model) {
  const Diagnosis d = diagnose(train, held_out, model);
  std::string names;
  for (const MissingEffect& m : d.missing) names += (names.empty() ? " " : ", ") + d.id(m.effect);
  return std::string(word(d.verdict)) + names + " (" + pretty(d.base_held_out, 3) + " -> " +
         pretty(d.final_held_out, 3) + " floors)";
}

void print_discovery(const Discovery& d, const DiscoverArguments& o, const std::string& name) {
  const auto width = width_of_prose();
  std::cout << "model `" << name << "` as it stands, fitted: error (1 = noise floor) training " << pretty(d.train, 3)
            << ", held-out " << pretty(d.held_out, 3) << ". What the library holds, emtb diagnose names first\n";
  if (d.worth_a_name || d.held_out > above_the_floor) {
    print_shares(d.torque, "torque", "N m");
    if (d.left.voltage_seen) print_shares(d.voltage, "voltage", "V");
    for (const std::string& line : shares_in_words(d)) std::cout << "\n" << fitted(line, width);
  }
  std::cout << "\n";
  if (d.law) {
    for (const std::string& line : law_in_words(*d.law)) std::cout << fitted(line, width);
    if (const std::string next = next_for_discovery(d); !next.empty()) std::cout << fitted(next, width);
    if (!o.out.empty()) std::cout << "written: " << o.out << ", ready for --candidates\n";
    if (!o.svg.empty()) std::cout << "written: " << o.svg << "\n";
  } else {
    std::cout << fitted(no_law_in_words(d), width);
  }
  for (const std::string& line : machine_in_words(d)) std::cout << fitted(line, width);
  if (const std::string both = with_and_without(d); !both.empty()) std::cout << fitted(both, width);
}

int discover_command(const DiscoverArguments& o) {
  const Model model = read_model(o.model);
  const std::vector<Run> train = o.runs(o.sessions), held_out = o.runs(o.held_out);
  if (!may_be_fitted(train, held_out, model, o.unchecked, o.json_file == "-" ? std::cerr : std::cout)) return 1;
  Progress progress;
  DiscoverOptions options;
  options.read = read_law;
  options.progress = [&](double share, const std::string& doing) { progress.show(share, doing); };
  const std::vector<Run> whole = split_at_gaps(train, model.input), judging = split_at_gaps(held_out, model.input);
  const Discovery d = discover(whole, judging, model, options);
  json out = to_json(d);
  std::string verdicts;
  if (d.with_disturbances) {
    progress.show(0.95, "diagnosing with the disturbances, and without");
    const std::string with = verdict_on(whole, judging, model),
                      without = verdict_on(d.train_runs, d.held_out_runs, model);
    out["verdicts"] = {{"with", with}, {"without", without}};
    verdicts = "emtb diagnose says with it: " + with + "; without it: " + without;
  }
  progress.clear();
  write_json(o.json_file, out);
  if (!o.out.empty() && d.law) {
    std::ofstream file(o.out);
    file << "# A law that emtb discover found: emtb diagnose MODEL SESSION... --candidates " << o.out << "\n";
    file << d.law->text.yaml();
    for (const FormulaText& t : d.law->tied_with) file << t.yaml();
    if (!file.flush()) throw Error(o.out + ": cannot be written");
  }
  if (const auto figure = law_figure(d); figure && !o.svg.empty()) write_svg(figure->figure, o.svg);
  if (o.json_file == "-") return d.law ? 0 : 1;
  print_discovery(d, o, model.name);
  if (!verdicts.empty()) std::cout << fitted(verdicts, width_of_prose());
  return d.law ? 0 : 1;
}

int trend_command(const DiscoverArguments& o) {
  const Model model = read_model(o.model);
  std::vector<std::string> names;
  std::vector<std::size_t> ends;
  std::vector<Run> all;
  for (const std::string& session : o.sessions) {
    std::vector<Run> runs = o.runs({session});
    const bool by_run = o.sessions.size() == 1;
    for (Run& run : runs) {
      if (by_run || &run == &runs.front()) names.push_back(by_run ? run.name : session);
      all.push_back(std::move(run));
      if (by_run) ends.push_back(all.size());
    }
    if (!by_run) ends.push_back(all.size());
  }
  if (names.size() < 2) throw Error("trend needs two runs or sessions at least, in the order of their time");
  if (!may_be_fitted(all, {}, model, o.unchecked, o.json_file == "-" ? std::cerr : std::cout)) return 1;
  Dataset data = prepare(all, {}, model);
  Model fitted = calibrate(data, model).model;
  const std::vector<std::size_t> places = places_to_hold(data.train, fitted);  // no session tells what all cannot
  if (!places.empty()) fitted = calibrate(data, hold(data.train, model, fitted, places)).model;
  std::vector<std::vector<Record>> groups;
  std::size_t begin = 0;
  for (const std::size_t end : ends) {
    groups.emplace_back(data.train.begin() + static_cast<std::ptrdiff_t>(begin),
                        data.train.begin() + static_cast<std::ptrdiff_t>(end));
    begin = end;
  }
  const std::vector<Trend> found = trends(groups, names, fitted);
  if (!o.svg.empty()) write_svg(trend_figure(found), o.svg);
  write_json(o.json_file, to_json(found));
  if (o.json_file == "-") return 0;
  for (const Trend& t : found) {
    std::cout << t.parameter << in_brackets(t.unit) << "\n";
    Table table({"session", "value", "+- 95 %"});
    for (const TrendPoint& p : t.points) table.row({p.run, pretty(p.value, 4), pretty(1.96 * p.std_error, 2)});
    std::cout << table.text("  ", width_of_rows());
    std::cout << "  " << in_words(t) << "\n";
  }
  if (!o.svg.empty()) std::cout << "written: " << o.svg << "\n";
  return 0;
}

}  // namespace

void add_discover_command(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers) {
  const auto o = std::make_shared<DiscoverArguments>();
  const auto on_files = [&](Command command) {
    command.argument("MODEL", o->model, "the model's YAML, with what the library explains in it already")
        .arguments("SESSION", o->sessions, "PATH[#RUN][@T0:T1], .csv, .h5 or .mat")
        .option("--map", o->map, "how the columns of foreign CSV files become signals")
        .option("--json", o->json_file, "writes the result to this file; - for standard output")
        .option("--svg", o->svg, "draws it into this file: the law's curve, or the parameters over the sessions")
        .flag("--unchecked", o->unchecked, unchecked_help);
    return command;
  };
  const auto act = [&](int (*command)(const DiscoverArguments&)) {
    return [o, answers, command] { return answers->answer(o->files(), [&] { return command(*o); }); };
  };
  on_files(line.command("discover", "looks for a law in what the library leaves, and for runs of another machine"))
      .options("--held-out", o->held_out, "sessions that judge a law; of two or more the shortest only confirms it")
      .option("--out", o->out, "writes the law as a file for --candidates")
      .action(act(discover_command));
  on_files(line.command("trend", "fits a model session by session: how its parameters drift, with bands"))
      .action(act(trend_command));
}

}  // namespace emtb
