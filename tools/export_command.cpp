#include <charconv>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <limits>
#include <nlohmann/json.hpp>

#include "config/model.h"
#include "export/closed_loop.h"
#include "export/controller.h"
#include "export/export_text.h"
#include "export/fmu.h"
#include "export/linear.h"
#include "figures/figure.h"
#include "figures/terminal.h"
#include "hal/error.h"
#include "hal/printable.h"
#include "report/result_json.h"
#include "report/text.h"
#include "tools/commands.h"
#include "tools/compiler.h"

namespace emtb {
namespace {

struct ExportOptions {
  std::string model, to, out, at;
  double load = 0;
  bool linear = false;
};

double number(const std::string& text, const std::string& option) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(value)) {
    throw Error(option + " " + printable(text) + ": not a number");
  }
  return value;
}

WorkingPoint point_of(const ExportOptions& o) {
  if (o.linear && o.at.empty()) throw Error("--linear needs --at RAD_S: about which speed");
  if (!o.linear && !o.at.empty()) throw Error("--at is the speed for --linear: give both, or neither");
  return {o.linear ? number(o.at, "--at") : std::numeric_limits<double>::quiet_NaN(), o.load};
}

/// An Octave function, and the library of an FMU, has the name of its file. @param what for the complaint
std::string function_name(const std::string& out, const std::string& what) {
  const std::string name = out.empty() ? "motor" : std::filesystem::path(out).stem().string();
  const auto fits = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; };
  if (!std::ranges::all_of(name, fits) || std::isdigit(static_cast<unsigned char>(name[0])) != 0) {
    throw Error("--out " + printable(out) + ": " + what + " is called as its file, letters, digits and _ alone");
  }
  return name;
}

/// With a library for this machine; other machines compile the sources that are in it.
std::string fmu_archive(const ExportOptions& o, const ExportedEquations& equations) {
  if (o.out.empty()) throw Error("--out FILE.fmu is missing: an FMU is an archive");
  Fmu fmu = fmu_of(equations, function_name(o.out, "the model in an FMU"));
  fmu.files.emplace_back(fmu.library, compiled_library(fmu.files, fmu.source));
  return zip_archive(fmu.files);
}

std::string exported(const ExportOptions& o) {
  const WorkingPoint at = point_of(o);
  const Model model = without_sensors(read_model(o.model));
  if (o.to == "state-space") return state_space_json(model, at);
  if (o.to == "transfer-function") return transfer_functions_json(model, at);
  const auto equations = [&] { return o.linear ? linear_equations(model, at) : equations_of(model); };
  if (o.to == "c") return c_header(equations());
  if (o.to == "octave") return octave_function(equations(), function_name(o.out, "an Octave function"));
  if (o.to == "modelica") return modelica_model(equations());
  return fmu_archive(o, equations());
}

int export_model_command(const ExportOptions& o) {
  if (o.to.empty()) throw Error("--to is missing: c, octave, state-space, transfer-function, modelica or fmu");
  const std::string text = exported(o);
  if (o.out.empty()) {
    std::cout << text;
    return 0;
  }
  std::ofstream file(o.out, std::ios::trunc | std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error(o.out + ": cannot be written. Give another --out FILE");
  std::cout << o.out << "\n";
  return 0;
}

struct GainsOptions {
  std::string model, json_file, at;
  std::vector<std::string> bandwidths;
  double current_bandwidth = 0, rate = 1000;
  bool plot = false;
};

/// All that is said of one bandwidth.
struct Design {
  Gains gains;
  Margins nominal[2];
  Spread spread[2];
  StepAnswer with[2], without[2];
};

constexpr Loop loops[] = {Loop::cascade, Loop::direct};
const char* name_of(Loop loop) { return loop == Loop::cascade ? "cascade" : "direct"; }

Design designed(const Model& model, const GainsOptions& o, const WorkingPoint& at, double bandwidth) {
  Design d;
  const LinearMachine motor = linearise(model, at);
  d.gains = gains_for(motor, {bandwidth, o.current_bandwidth, o.rate});
  const double own = motor.R * motor.J / (motor.R * motor.B + motor.K_b * motor.K_m);
  StepWishes wishes{.speed = at.omega, .rate = o.rate};
  wishes.duration = std::max(6 * own, 5 / d.gains.speed_bandwidth);
  if (model.driver && model.driver->rise > 0) wishes.duration += 3 * std::abs(motor.e_a) / model.driver->rise;
  for (int k = 0; k < 2; ++k) {
    d.nominal[k] = margins_of(d.gains, motor, loops[k], o.rate);
    d.spread[k] = spread_of(model, at, d.gains, loops[k], o.rate);
    wishes.loop = loops[k];
    wishes.feed_forward = true;
    d.with[k] = step_answer(model, d.gains, wishes);
    wishes.feed_forward = false;
    d.without[k] = step_answer(model, d.gains, wishes);
  }
  return d;
}

nlohmann::ordered_json answer_json(const StepAnswer& a) {
  return {{"rise_s", number_json(a.rise)},
          {"overshoot", number_json(a.overshoot)},
          {"settled_s", number_json(a.settled)},
          {"left_rad_s", number_json(a.left)},
          {"largest_current_A", number_json(a.largest_current)},
          {"limited", number_json(a.limited)}};
}

nlohmann::ordered_json design_json(const Design& d) {
  const auto pi = [](const Pi& c) { return nlohmann::ordered_json{{"kp", c.kp}, {"ki", c.ki}}; };
  nlohmann::ordered_json out{{"speed_bandwidth_Hz", d.gains.speed_bandwidth},
                             {"current_bandwidth_Hz", d.gains.current_bandwidth}};
  out["gains"] = {{"speed", pi(d.gains.speed)},
                  {"current", pi(d.gains.current)},
                  {"back_emf", d.gains.back_emf},
                  {"direct", pi(d.gains.direct)}};
  for (int k = 0; k < 2; ++k) {
    out[name_of(loops[k])] = {{"phase_margin_deg", number_json(d.nominal[k].phase)},
                              {"gain_margin_dB", number_json(d.nominal[k].gain)},
                              {"least_phase_margin_deg", number_json(d.spread[k].least.phase)},
                              {"least_gain_margin_dB", number_json(d.spread[k].least.gain)},
                              {"draws", d.spread[k].draws},
                              {"step", answer_json(d.with[k])},
                              {"step_without_feed_forward", answer_json(d.without[k])}};
  }
  return out;
}

void print(const Design& d, std::size_t width) {
  const Gains& g = d.gains;
  std::cout << "\nspeed loop " << pretty(g.speed_bandwidth, 3) << " Hz, current loop " << pretty(g.current_bandwidth, 3)
            << " Hz\n";
  Table gains({"  controller", "kp", "", "ki", ""});
  gains.row({"  speed, to a current", pretty(g.speed.kp), "A s/rad", pretty(g.speed.ki), "A/rad"});
  gains.row({"  current, to a voltage", pretty(g.current.kp), "V/A", pretty(g.current.ki), "V/(A s)"});
  gains.row({"  direct: speed, to a voltage", pretty(g.direct.kp), "V s/rad", pretty(g.direct.ki), "V/rad"});
  std::cout << gains.text("", width_of_rows()) << "  the current loop adds K_b omega, " << pretty(g.back_emf)
            << " V s/rad\n";
  Table margins({"  margins", "phase", "least", "gain", "least"});
  Table steps({"  step on the whole model", "rise", "overshoot", "within 2 %", "off at end", "current", "at a limit"});
  const double negligible = 1e-4 * std::max(1e-6, std::abs(d.with[0].omega.back()));  // [rad/s]
  const auto decibel = [](double x) { return std::isfinite(x) ? pretty(x, 3) + " dB" : std::string("-"); };
  const auto seconds = [](double x) { return std::isfinite(x) ? pretty(x, 3) + " s" : std::string("never"); };
  for (int k = 0; k < 2; ++k) {
    const std::string loop = std::string("  ") + name_of(loops[k]);
    const bool drawn = d.spread[k].draws > 0;
    margins.row({loop, pretty(d.nominal[k].phase, 3) + " deg",
                 drawn ? pretty(d.spread[k].least.phase, 3) + " deg" : "-", decibel(d.nominal[k].gain),
                 drawn ? decibel(d.spread[k].least.gain) : "-"});
    for (const auto& [what, a] : {std::pair{"", &d.with[k]}, {", no feed-forward", &d.without[k]}}) {
      steps.row({loop + what, seconds(a->rise), pretty(100 * a->overshoot, 2) + " %", seconds(a->settled),
                 pretty(std::round(a->left / negligible) * negligible + 0.0, 2) + " rad/s",
                 pretty(a->largest_current, 3) + " A", pretty(100 * a->limited, 2) + " %"});
    }
  }
  std::cout << margins.text("", width_of_rows()) << steps.text("", width_of_rows());
  if (d.spread[0].draws == 0) {
    std::cout << wrapped("The model file has no standard errors: calibrate it, and the least margins are those over " +
                             std::string("what the data leave open."),
                         width)
              << "\n";
  }
  if (std::max(d.with[0].limited, d.with[1].limited) > 0.2) {
    std::cout << wrapped(
                     "The driver is at a limit for much of the step: its range or its slope decides how fast this " +
                         std::string("is, not the gains."),
                     width)
              << "\n";
  }
}

int gains_command(const GainsOptions& o) {
  const Model model = without_sensors(read_model(o.model));
  if (!(o.rate >= 10 && o.rate <= 1e5)) throw Error("--rate must be 10 to 100000 Hz");
  const double top = top_speed(model);
  const WorkingPoint at{.omega = o.at.empty() ? 0.5 * top : number(o.at, "--at")};
  if (at.omega == 0) throw Error("--at 0: the step would go nowhere. Give a speed in rad/s");
  std::vector<double> bandwidths;
  for (const std::string& text : o.bandwidths) {
    bandwidths.push_back(number(text, "--bandwidth"));
    if (bandwidths.back() <= 0) throw Error("--bandwidth " + printable(text) + ": must be more than 0 Hz");
  }
  if (bandwidths.empty()) bandwidths.push_back(0);
  const FeedForward ahead = feed_forward_of(model, std::abs(at.omega) > top ? std::abs(at.omega) : top);
  nlohmann::ordered_json out{{"model", model.name}, {"at_rad_s", at.omega}, {"top_rad_s", top}, {"rate_Hz", o.rate}};
  out["feed_forward"] = {{"omega", ahead.omega}, {"i_a", ahead.i_a}, {"e_driver", ahead.e_a}};
  out["designs"] = nlohmann::ordered_json::array();
  std::vector<Design> designs;
  for (const double bandwidth : bandwidths) {
    designs.push_back(designed(model, o, at, bandwidth));
    out["designs"].push_back(design_json(designs.back()));
  }
  write_json(o.json_file, out);
  if (o.json_file == "-") return 0;
  std::cout << fitted("model `" + model.name + "`: gains for " + pretty(at.omega, 3) + " rad/s, computed " +
                          pretty(o.rate) + " times a second",
                      width_of_prose());
  for (const Design& d : designs) print(d, width_of_prose());
  std::cout << "\n"
            << fitted("feed-forward: the current and the voltage that hold a speed against friction", width_of_prose());
  Table table({"  omega [rad/s]", "i_a [A]", "e [V]"});
  for (std::size_t i = 0; i < ahead.omega.size(); ++i)
    table.row({"  " + pretty(ahead.omega[i], 3), pretty(ahead.i_a[i], 3), pretty(ahead.e_a[i], 3)});
  std::cout << table.text("", width_of_rows());
  if (!o.plot) return 0;
  Figure figure("Step of the speed on the whole model", "Speed over time with each controller.");
  figure.x({"t", "s"});
  Panel& speed = figure.panel({"omega", "rad/s"});
  for (int k = 0; k < 2; ++k)
    speed.line(name_of(loops[k]), designs[0].with[k].t, designs[0].with[k].omega,
               {k == 0 ? Ink::blue : Ink::vermilion});
  std::cout << "\n" << to_terminal(figure, style_of_stdout());
  return 0;
}

}  // namespace

void add_export_commands(CommandLine& line) {
  const auto o = std::make_shared<ExportOptions>();
  line.command("export-model", "writes a model for other programs: C, Octave, Modelica, an FMU, or a linear system")
      .argument("MODEL", o->model, "the model's YAML")
      .option("--to", o->to, "c, octave, state-space, transfer-function, modelica or fmu (2.0, co-simulation)")
      .one_of({"c", "octave", "state-space", "transfer-function", "modelica", "fmu"})
      .option("--out", o->out, "the file to write; without it standard output")
      .flag("--linear", o->linear, "all effects as straight lines about the speed --at")
      .option("--at", o->at, "[rad/s] the speed for --linear")
      .option("--load", o->load, "[N m] that a load takes there")
      .action([o] { return export_model_command(*o); });
  const auto g = std::make_shared<GainsOptions>();
  line.command("gains", "finds gains of a speed controller for a model, with margins, and tries them on the model")
      .argument("MODEL", g->model, "the model's YAML; calibrated, it carries the standard errors")
      .options("--bandwidth", g->bandwidths, "[Hz] of the speed loop, one or more; without it twice the motor's own")
      .option("--current-bandwidth", g->current_bandwidth, "[Hz] of the current loop; 0: a twentieth of the rate")
      .option("--rate", g->rate, "[Hz] at which the controller computes")
      .option("--at", g->at,
              "[rad/s] the step from rest, and where the motor is looked at; without it half of its top speed")
      .flag("--plot", g->plot, "draws the step")
      .option("--json", g->json_file, "writes the result to this file; - for standard output")
      .action([g] { return gains_command(*g); });
}

}  // namespace emtb
