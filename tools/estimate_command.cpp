#include <algorithm>
#include <charconv>
#include <filesystem>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>

#include "analysis/diagnose/compare.h"
#include "analysis/estimate/inverse_dynamics.h"
#include "analysis/estimate/static_experiments.h"
#include "analysis/fit/calibrate.h"
#include "analysis/fit/timing.h"
#include "config/mapping.h"
#include "config/model.h"
#include "hal/error.h"
#include "hal/unit.h"
#include "model/catalogue.h"
#include "paper/estimate_figure.h"
#include "report/result_json.h"
#include "report/symbols.h"
#include "report/text.h"
#include "session/spec.h"
#include "session/text.h"
#include "tools/commands.h"

namespace emtb {
namespace {

using json = nlohmann::ordered_json;

struct EstimateOptions {
  std::string model, map, json_file, png, svg;
  std::vector<std::string> sessions, what, settled;

  std::vector<Run> runs() const { return read_runs(sessions, map.empty() ? Mapping{} : read_mapping(map)); }
};

/// What --what may be.
std::vector<std::string> experiment_names() {
  std::vector<std::string> names;
  for (const StaticExperiment e : static_experiments) names.emplace_back(name(e));
  names.emplace_back("all");
  return names;
}

/// What is to be found.
std::vector<StaticExperiment> wanted(const EstimateOptions& o) {
  const bool model = !o.model.empty();
  std::vector<std::string> names = o.what;
  if (names.empty()) names.emplace_back(model ? name(StaticExperiment::inverse_dynamics) : "all");
  std::vector<StaticExperiment> all;
  for (const std::string& text : names) {
    const auto known = std::ranges::find(static_experiments, text, [](StaticExperiment e) { return name(e); });
    if (text == "all") {
      all.assign(static_experiments.begin(), static_experiments.end());
      if (!model) std::erase(all, StaticExperiment::inverse_dynamics);
    } else if (known != static_experiments.end()) {
      all.push_back(*known);
    }
  }
  return all;
}

double seconds(std::string_view text, const std::string& whole) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw Error("--settled " + shown(whole) + ": not a stretch. Write T0:T1 in seconds, such as 5.5:9");
  }
  return value;
}

SettledOptions settled_options(const EstimateOptions& o) {
  SettledOptions options;
  for (const std::string& text : o.settled) {
    const std::size_t colon = std::min(text.find(':'), text.size());
    options.chosen.emplace_back(seconds(std::string_view(text).substr(0, colon), text),
                                seconds(std::string_view(text).substr(std::min(colon + 1, text.size())), text));
  }
  return options;
}

/// What a model says that somebody has measured or fitted; a start value is a guess.
KnownParameters known_from(const Model& model, const std::string& file) {
  KnownParameters known;
  const std::vector<std::string> names = model.names();
  const std::vector<double> values = model.values();
  const auto dry_friction = std::ranges::find(effect_catalogue(), true, &EffectInfo::dry_friction);
  for (std::size_t i = 0; i < names.size(); ++i) {
    const auto tie = model.tie.find(names[i]);
    const auto leader =
        tie == model.tie.end() ? names.begin() + static_cast<std::ptrdiff_t>(i) : std::ranges::find(names, tie->second);
    const Parameter& p = model.at(static_cast<std::size_t>(leader - names.begin()));
    const Quantity q{names[i], values[i], p.std_error.value_or(0), model.at(i).unit};
    const bool measured = p.fixed || p.std_error;
    if (i == base::K_m) {
      known.K_m = q;
      known.K_m_is_guess = !measured;
      known.K_m_from = (measured ? "the one of " : "the start value, a guess, of ") + file;
    }
    if (i == base::B && measured) known.B = q;
    if (names[i] == full_name(*dry_friction) && measured) known.T_c = q;
  }
  if (!known.T_c) known.B.reset();  // a B that stands for dry friction is no B beside it
  known.T_c_from = "the one of " + file;
  return known;
}

/// J by a fit of the whole runs, for comparison.
StaticEstimate whole_run(const std::vector<Run>& runs, const Model& model) {
  StaticEstimate result{.method = StaticMethod::whole_run, .title = "J by a fit of the model to the whole runs"};
  try {
    Dataset data = prepare(runs, {}, model);
    const Calibration fit = calibrate(data, model);
    const std::vector<std::string> names = fit.model.names();
    const std::vector<double> values = fit.model.values();
    for (std::size_t i = 0; i < names.size(); ++i) {
      const Parameter& p = fit.model.at(i);
      if (p.std_error) result.quantities.push_back({names[i], values[i], *p.std_error, p.unit});
    }
    for (const Record& run : data.train) {
      result.used.push_back({run.name, run.excitation.t.front(), run.excitation.t.back()});
      for (const Observation& o : run.observations) result.points += o.size();
    }
    const std::map<Signal, SignalFit> fits = fit_of(data.train, fit.model, data.noise);
    const auto speed = fits.find(Signal::omega);
    const double miss = 1 - (speed == fits.end() ? fits.begin() : speed)->second.fit_percent / 100;
    result.r_squared = 1 - miss * miss;
    for (const Undetermined& u : fit.identifiability.undetermined) {
      result.remarks.push_back("these runs do not determine " + u.combination);
    }
  } catch (const Error& e) {
    result.lacking = e.what();
  }
  return result;
}

StaticEstimate as_estimate(const InverseDynamics& dynamics) {
  StaticEstimate result{.method = StaticMethod::inverse_dynamics,
                        .title = "K_m i_a = J dω/dt + B ω + T_c sign(ω) + T_L"};
  for (const auto& v : dynamics.values) result.quantities.push_back({v.symbol, v.value, v.std_error, v.unit});
  result.r_squared = dynamics.r_squared;
  result.points = dynamics.rows;
  return result;
}

/// Values that no motor has, and what usually brings them about.
void doubt(StaticEstimate& e) {
  for (const Quantity& q : e.quantities) {
    if (q.value >= 0) continue;
    if (q.symbol == base_parameters[base::R_a].symbol) {
      e.remarks.push_back(
          "R_a is negative, which no armature is: e_a or i_a has the wrong sign, or the motor was "
          "driven. Ask emtb check, then turn one of them: scale: -1 in --map or in the bench file");
    } else if (q.symbol == base_parameters[base::J].symbol) {
      e.remarks.push_back(
          "J is negative, which no inertia is: omega and i_a (or torque) have opposite signs. Ask emtb "
          "check");
    }
  }
}

std::string times(const Stretch& s) { return pretty(s.from, 6) + ":" + pretty(s.to, 6); }

void print(const StaticEstimate& e) {
  std::cout << name(experiment_of(e.method)) << ": " << e.title << "\n";
  if (!e.lacking.empty()) std::cout << "  no result: " << e.lacking << "\n";
  Table table({"", "value", "+- std error", "unit"});
  for (const Quantity& q : e.quantities)
    table.row({q.symbol, pretty(q.value, 5), pretty(q.std_error, 2), shown_unit(q.unit)});
  if (!e.quantities.empty()) std::cout << table.text("  ");
  if (e.lacking.empty()) {
    std::cout << "  R2 " << pretty(e.r_squared, 6) << ", " << e.points << (e.points == 1 ? " point" : " points")
              << "\n";
  }
  using Spans = std::map<std::string, std::string>;  // by run
  Spans used;
  std::map<std::string, Spans> left_out;  // by reason
  for (const Stretch& s : e.used) used[short_name(s.run)] += " " + times(s);
  for (const LeftOut& l : e.left_out) left_out[l.why][short_name(l.where.run)] += " " + times(l.where);
  for (const auto& [run, spans] : used) std::cout << "  from " << run << " [s]" << spans << "\n";
  for (const auto& [why, runs] : left_out) {
    for (const auto& [run, spans] : runs) std::cout << "  left out, " << why << ": " << run << " [s]" << spans << "\n";
  }
  for (const std::string& remark : e.remarks) std::cout << "  note: " << remark << "\n";
}

json to_json(const StaticEstimate& e) {
  json out{{"what", name(experiment_of(e.method))}, {"method", name(e.method)}, {"title", e.title}};
  out["lacking"] = e.lacking.empty() ? json(nullptr) : json(e.lacking);
  out["parameters"] = json::object();
  for (const Quantity& q : e.quantities) {
    out["parameters"][q.symbol] = {{"value", q.value}, {"std_error", q.std_error}, {"unit", q.unit}};
  }
  out["r_squared"] = e.lacking.empty() ? json(e.r_squared) : json(nullptr);
  out["points"] = e.points;
  out["used"] = out["left_out"] = json::array();
  for (const Stretch& s : e.used) out["used"].push_back({{"run", s.run}, {"from", s.from}, {"to", s.to}});
  for (const LeftOut& l : e.left_out) {
    out["left_out"].push_back({{"run", l.where.run}, {"from", l.where.from}, {"to", l.where.to}, {"why", l.why}});
  }
  out["remarks"] = e.remarks;
  return out;
}

void draw(const std::vector<StaticEstimate>& all, const std::string& folder, bool png) {
  if (folder.empty()) return;
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw Error(folder + ": cannot be made (" + error.message() + "). Give another folder");
  for (const StaticEstimate& e : all) {
    if (!has_points(e)) continue;
    const auto file = std::filesystem::path(folder) / (std::string(name(e.method)) + (png ? ".png" : ".svg"));
    png ? write_png(figure_of(e), file) : write_svg(figure_of(e), file);
    std::cout << file.string() << "\n";
  }
}

int inverse_dynamics_alone(const EstimateOptions& o) {
  if (o.model.empty()) throw Error("inverse dynamics need --model FILE: its K_m turns the current into torque");
  const InverseDynamics result = inverse_dynamics(o.runs(), read_model(o.model).values()[2]);
  json out = json::object();
  Table table({"inverse dynamics", "value", "+- std error", "unit"});
  for (const auto& v : result.values) {
    table.row({v.symbol, pretty(v.value, 5), pretty(v.std_error, 2), shown_unit(v.unit)});
    out["parameters"][v.symbol] = {{"value", v.value}, {"std_error", v.std_error}, {"unit", v.unit}};
  }
  out["residual"] = result.residual;
  out["r_squared"] = result.r_squared;
  write_json(o.json_file, out);
  if (o.json_file == "-") return 0;
  std::cout << table.text() << "R2 " << pretty(result.r_squared, 6) << ", residual " << pretty(result.residual, 3)
            << " N m, " << result.rows << " equations\n";
  return 0;
}

int estimate_command(const EstimateOptions& o) {
  const std::vector<StaticExperiment> experiments = wanted(o);
  const auto is_wanted = [&](StaticExperiment e) { return std::ranges::find(experiments, e) != experiments.end(); };
  if (experiments == std::vector{StaticExperiment::inverse_dynamics}) return inverse_dynamics_alone(o);
  const std::vector<Run> measured = o.runs(), runs = with_speed(measured);
  std::optional<Model> model;
  if (!o.model.empty()) model = read_model(o.model);
  const Settled settled = settled_points(runs, settled_options(o));
  std::vector<StaticEstimate> all =
      evaluate(experiments, runs, settled, model ? known_from(*model, o.model) : KnownParameters{});
  if (model && is_wanted(StaticExperiment::inertia)) all.push_back(whole_run(measured, *model));
  if (is_wanted(StaticExperiment::inverse_dynamics)) {
    if (!model) throw Error("inverse dynamics need --model FILE: its K_m turns the current into torque");
    try {
      all.push_back(as_estimate(inverse_dynamics(measured, model->values()[2])));
    } catch (const SessionError& e) {
      all.push_back({.method = StaticMethod::inverse_dynamics,
                     .title = "K_m i_a = J dω/dt + B ω + T_c sign(ω) + T_L",
                     .lacking = e.what()});
    }
  }
  std::ranges::for_each(all, doubt);
  json out{{"estimates", json::array()}};
  for (const StaticEstimate& e : all) out["estimates"].push_back(to_json(e));
  write_json(o.json_file, out);
  const bool any = std::ranges::any_of(all, [](const StaticEstimate& e) { return e.lacking.empty(); });
  if (o.json_file == "-") return any ? 0 : 1;
  for (const StaticEstimate& e : all) {
    print(e);
    std::cout << "\n";
  }
  draw(all, o.png, true);
  draw(all, o.svg, false);
  return any ? 0 : 1;
}

}  // namespace

void add_estimate_command(CommandLine& line, const std::shared_ptr<const KeptAnswers>& answers) {
  const auto o = std::make_shared<EstimateOptions>();
  line.command("estimate", "estimates parameters by the experiments of the paper, without a simulation")
      .arguments("SESSION", o->sessions, "PATH[#RUN][@T0:T1], .csv, .h5 or .mat")
      .options(
          "--what", o->what,
          "resistance, generator, friction, torque-constant, inertia, coast-down, driver, inverse-dynamics or all; "
          "without it all, or with a model inverse-dynamics")
      .one_of(experiment_names())
      .option("--model", o->model, "a model whose K_m, T_c and B, where fixed or fitted, count as known")
      .option("--map", o->map, "how the columns of foreign CSV files become signals")
      .options("--settled", o->settled,
               "T0:T1 [s], stretches of each run that count as settled, instead of those found")
      .option("--json", o->json_file, "writes it to this file; - for standard output")
      .option("--png", o->png, "draws each experiment into this folder")
      .option("--svg", o->svg, "the same as SVG")
      .action([o, answers] {
        return answers->answer(
            {files_read({o->model, o->map}, o->sessions), files_written({o->json_file, o->png, o->svg})},
            [&] { return estimate_command(*o); });
      });
}

}  // namespace emtb
