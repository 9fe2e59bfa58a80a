#include <algorithm>
#include <cmath>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>

#include "analysis/discover/discover.h"
#include "analysis/fit/gauge.h"
#include "analysis/fit/timing.h"
#include "config/formula_effect.h"
#include "config/mapping.h"
#include "config/model.h"
#include "hal/error.h"
#include "report/progress.h"
#include "report/result_json.h"
#include "report/text.h"
#include "session/gaps.h"
#include "session/spec.h"
#include "tools/checked.h"
#include "tools/commands.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct DiscoverArguments {
  std::string model, map, out, json_file;
  std::vector<std::string> sessions, held_out;
  bool unchecked = false;

  std::vector<Run> runs(const std::vector<std::string>& specs) const {
    auto all = read_runs(specs, map.empty() ? Mapping{} : read_mapping(map));
    refuse_slow_readings(all);
    return all;
  }
};

std::string key_of(TermPlace place) {
  return place == TermPlace::torque ? "torque" : place == TermPlace::voltage ? "voltage" : "factor";
}

json law_json(const Law& law) {
  json parameters = json::object();
  for (const Parameter& p : law.parameters) {
    parameters[p.symbol] = {{"value", number_json(p.value)},
                            {"std_error", p.fixed ? json(0) : json(number_json(p.std_error))},
                            {"unit", p.unit}};
  }
  json tied = json::array();
  for (const FormulaText& t : law.tied_with) tied.push_back(t.formula);
  json one{{"place", key_of(law.text.place)}, {"of", law.text.of}, {"formula", law.text.formula}};
  one["id"] = law.text.id;
  one["parameters"] = parameters;
  one["error"] = {
      {"before", {{"train", number_json(law.train_before)}, {"held_out", number_json(law.held_out_before)}}},
      {"after", {{"train", number_json(law.train_after)}, {"held_out", number_json(law.held_out_after)}}}};
  one["confirmed"] = {{"before", number_json(law.confirm_before)}, {"after", number_json(law.confirm_after)}};
  one["nats"] = number_json(law.nats);
  one["curve"] = {{"at", law.at}, {"value", law.value}};
  one["resembles"] = law.resembles;
  one["likeness"] = number_json(law.likeness);
  one["tied_with"] = tied;
  return one;
}

json shares_json(const Shares& s) {
  json of = json::object();
  for (const auto& [name, share] : s.of) {
    of[name] = {{"alone", number_json(share.alone)},
                {"only", number_json(share.only)},
                {"std_error", number_json(share.std_error)}};
  }
  return {{"rms", number_json(s.rms)},
          {"of", of},
          {"together", number_json(s.together)},
          {"ceiling", number_json(s.ceiling)}};
}

json discovery_json(const Discovery& d) {
  json out{{"laws", json::array()}, {"changed", json::array()}, {"disturbances", json::array()}};
  if (d.law) out["laws"].push_back(law_json(*d.law));
  for (const Changed& c : d.changed) {
    out["changed"].push_back({{"run", c.run},
                              {"parameter", c.parameter},
                              {"from", number_json(c.from)},
                              {"to", number_json(c.to)},
                              {"std_error", number_json(c.std_error)},
                              {"unit", c.unit}});
  }
  for (const Disturbance& x : d.disturbances) {
    out["disturbances"].push_back(
        {{"run", x.run}, {"from_s", x.from_s}, {"to_s", x.to_s}, {"torque", number_json(x.torque)}});
  }
  out["left"] = json::object();
  for (const auto& [signal, rmse] : d.rmse) {
    json of = json::object();
    const Shares& s = signal == Signal::i_a && d.left.voltage_seen ? d.voltage : d.torque;
    for (const auto& [name, share] : s.of) of[name] = number_json(std::max(0.0, share.alone));
    out["left"][std::string(info(signal).name)] = {{"rmse", number_json(rmse)}, {"of", of}};
  }
  out["missing"] = {{"torque", shares_json(d.torque)}, {"voltage", shares_json(d.voltage)}};
  out["error"] = {{"train", number_json(d.train)}, {"held_out", number_json(d.held_out)}};
  out["worth_a_name"] = d.worth_a_name;
  out["parameters"] = parameters_json(d.law ? d.law->model : d.fitted);
  return out;
}

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
  std::cout << table.text("  ");
}

/// Why there is no law, in a sentence.
std::string no_law(const Discovery& d) {
  constexpr double ceiling = 0.2;
  if (!d.worth_a_name) {
    return "no law: what is left is no remainder worth a name: at the noise floor, or under 2 % of how much its signal "
           "varies, or not the same from piece to piece";
  }
  if (d.judged_on_training) return "no law: a single run cannot judge one. Name another with --held-out";
  const double most = std::max(d.torque.ceiling, d.left.voltage_seen ? d.voltage.ceiling : 0.0);
  const std::string share = pretty(std::round(100 * most), 3) + " %";
  if (most < ceiling) {
    return "no law: run to run, memory or reading. A smooth function of the measured states explains " + share +
           " of it on runs left out, under 20 %";
  }
  return "no law: smooth functions of the measured states explain " + share +
         " of it on runs left out, but no formula of three parameters is material, determined and confirmed";
}

void print_law(const Law& law) {
  std::cout << "\nA law: " << key_of(law.text.place) << " = " << law.text.formula << "\n";
  for (const Parameter& p : law.parameters) {
    std::cout << "  " << p.symbol << " = "
              << (p.fixed       ? pretty(p.value, 4) + " " + p.unit + ", held"
                  : p.std_error ? pretty(p.value, *p.std_error, p.unit)
                                : pretty(p.value, 3) + " " + p.unit)
              << "\n";
  }
  std::cout << "error (1 = noise floor): training " << pretty(law.train_before, 3) << " -> "
            << pretty(law.train_after, 3) << ", held-out " << pretty(law.held_out_before, 3) << " -> "
            << pretty(law.held_out_after, 3) << "; Q rises by " << pretty(law.nats, 3) << " nats\n";
  if (law.confirm_after) {
    std::cout << "confirmed on a run that neither choice nor fit saw: " << pretty(*law.confirm_before, 3) << " -> "
              << pretty(*law.confirm_after, 3) << "\n";
  } else {
    std::cout << "not confirmed: name two sessions or more with --held-out, and the shortest confirms\n";
  }
  if (!law.resembles.empty()) {
    std::cout << "like " << law.resembles << ": the cosine of what both do to the readings is "
              << pretty(law.likeness, 2) << ". emtb diagnose tries that one first\n";
  }
  for (const FormulaText& t : law.tied_with) std::cout << "tied with " << key_of(t.place) << " = " << t.formula << "\n";
}

void print_machine(const Discovery& d) {
  for (const Changed& c : d.changed) {
    std::cout << c.run << ": " << c.parameter << " is " << pretty(c.to, 4) << " " << c.unit << " here, "
              << pretty(c.from, 4) << " +- " << pretty(c.std_error, 2) << " in the other runs ("
              << pretty(std::round(100 * (c.to / c.from - 1)), 3) << " %)\n";
  }
  for (const Disturbance& x : d.disturbances) {
    std::cout << x.run << ": a torque of " << pretty(x.torque, 3) << " N m from " << pretty(x.from_s, 4) << " to "
              << pretty(x.to_s, 4) << " s, which the same speed and current do not show elsewhere\n";
  }
}

int discover_command(const DiscoverArguments& o) {
  const Model model = read_model(o.model);
  const std::vector<Run> train = o.runs(o.sessions), held_out = o.runs(o.held_out);
  if (!may_be_fitted(train, held_out, model, o.unchecked, o.json_file == "-" ? std::cerr : std::cout)) return 1;
  Progress progress;
  DiscoverOptions options;
  options.read = [](const FormulaText& text) { return read_formula(YamlMap::parse(text.yaml(), "a law"), text.id); };
  options.progress = [&](double share, const std::string& doing) { progress.show(share, doing); };
  const Discovery d = discover(split_at_gaps(train, model.input), split_at_gaps(held_out, model.input), model, options);
  progress.clear();
  write_json(o.json_file, discovery_json(d));
  if (!o.out.empty() && d.law) {
    std::ofstream file(o.out);
    file << "# A law that emtb discover found: emtb diagnose MODEL SESSION... --candidates " << o.out << "\n";
    file << d.law->text.yaml();
    for (const FormulaText& t : d.law->tied_with) file << t.yaml();
    if (!file.flush()) throw Error(o.out + ": cannot be written");
  }
  if (o.json_file == "-") return d.law ? 0 : 1;
  std::cout << "model `" << model.name << "` as it stands, fitted: error (1 = noise floor) training "
            << pretty(d.train, 3) << ", held-out " << pretty(d.held_out, 3)
            << ". What the library holds, emtb diagnose names first\n";
  if (d.worth_a_name || d.held_out > above_the_floor) {
    print_shares(d.torque, "torque", "N m");
    if (d.left.voltage_seen) print_shares(d.voltage, "voltage", "V");
  }
  if (d.law) {
    print_law(*d.law);
    if (!o.out.empty()) std::cout << "written: " << o.out << ", ready for --candidates\n";
  } else {
    std::cout << "\n" << no_law(d) << "\n";
  }
  print_machine(d);
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
  json out = json::object();
  for (const Trend& t : found) {
    json points = json::array();
    for (const TrendPoint& p : t.points) {
      points.push_back({{"session", p.run}, {"value", number_json(p.value)}, {"std_error", number_json(p.std_error)}});
    }
    out[t.parameter] = {{"unit", t.unit},
                        {"points", points},
                        {"slope", number_json(t.slope)},
                        {"slope_error", number_json(t.slope_error)},
                        {"clear", t.clear}};
  }
  write_json(o.json_file, out);
  if (o.json_file == "-") return 0;
  for (const Trend& t : found) {
    std::cout << t.parameter << " [" << t.unit << "]\n";
    Table table({"session", "value", "+- 95 %"});
    for (const TrendPoint& p : t.points) table.row({p.run, pretty(p.value, 4), pretty(1.96 * p.std_error, 2)});
    std::cout << table.text("  ");
    if (t.points.size() < 3) {
      std::cout << "  three sessions at least tell a trend\n";
    } else {
      std::cout << "  from one to the next " << pretty(t.slope, 3) << " +- " << pretty(1.96 * t.slope_error, 2)
                << " (95 %)" << (t.clear ? ": a trend\n" : ": no trend that is clear of the scatter\n");
    }
  }
  return 0;
}

}  // namespace

void add_discover_command(CommandLine& line) {
  const auto o = std::make_shared<DiscoverArguments>();
  const auto on_files = [&](Command command) {
    command.argument("MODEL", o->model, "the model's YAML, with what the library explains in it already")
        .arguments("SESSION", o->sessions, "PATH[#RUN][@T0:T1], .csv, .h5 or .mat")
        .option("--map", o->map, "how the columns of foreign CSV files become signals")
        .option("--json", o->json_file, "writes the result to this file; - for standard output")
        .flag("--unchecked", o->unchecked, unchecked_help);
    return command;
  };
  on_files(line.command("discover", "looks for a law in what the library leaves, and for runs of another machine"))
      .options("--held-out", o->held_out, "sessions that judge a law; of two or more the shortest only confirms it")
      .option("--out", o->out, "writes the law as a file for --candidates")
      .action([o] { return discover_command(*o); });
  on_files(line.command("trend", "fits a model session by session: how its parameters drift, with bands")).action([o] {
    return trend_command(*o);
  });
}

}  // namespace emtb
