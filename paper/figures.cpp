#include <algorithm>
#include <cmath>

#include "paper/estimate_figure.h"
#include "paper/page.h"
#include "paper/text.h"

namespace emtb::paper {
namespace {

const Pen measured{.ink = Ink::grey, .width = 1.5, .dash = Dash::solid, .marker = Marker::none};
const Pen ours{.ink = Ink::blue, .width = 1.5, .dash = Dash::solid, .marker = Marker::none};
const Pen printed_line{.ink = Ink::vermilion, .width = 1.5, .dash = Dash::dashed, .marker = Marker::none};

/// A static experiment's points with its line, and the line that the paper printed.
Figure with_printed(const StaticEstimate& estimate, const std::string& title, double slope, double intercept) {
  Figure figure = figure_of(estimate);
  figure.title = title;
  const auto [low, high] = std::ranges::minmax(estimate.series.front().x);
  const double from = std::min(0.0, low);
  figure.panels.front().line(
      "printed: y = " + number(slope) + "x " + (intercept < 0 ? "- " : "+ ") + number(std::abs(intercept), 5),
      {from, high}, {intercept + slope * from, intercept + slope * high},
      {.ink = Ink::grey, .width = 1.5, .dash = Dash::dashed, .marker = Marker::none});
  return figure;
}

std::pair<std::vector<double>, std::vector<double>> part(const Series& s, double from, double to, double zero,
                                                         std::size_t every) {
  std::pair<std::vector<double>, std::vector<double>> xy;
  for (std::size_t k = 0; k < s.t.size(); k += every) {
    if (s.t[k] < from || s.t[k] > to) continue;
    xy.first.push_back(s.t[k] - zero);
    xy.second.push_back(s.value[k]);
  }
  return xy;
}

Figure figure_7(const Findings& f) {
  constexpr double shown = 1.6, before = 0.2;  // [s]
  Figure figure(
      "Figure 7: a start past the driver and behind it",
      "Speed after a contactor closes on 110 V, after a reference step behind the driver, and the paper's slope");
  figure.x({"t after the switch-on", "s"});
  Panel& speed = figure.panel({"ω", "rad/s"}, 260);
  const auto [tc, wc] = part(f.contactor.at(Signal::omega), 0.4 - before, 0.4 + shown, 0.4, 4);
  const auto [td, wd] = part(f.rising.at(Signal::omega), 1 - before, 1 + shown, 1, 2);
  speed.line("110 V at once", tc, wc, ours).line("behind the driver, 22.5 V/s", td, wd, measured);
  const double until = 0.4;
  speed.line("printed slope, 268.29 rad/s²", {0, until}, {0, printed::acceleration * until}, printed_line);
  Panel& current = figure.panel({"i_{a}", "A"}, 140);
  const Series& meter = f.contactor.at(Signal::i_a);
  std::vector<double> t, i;
  for (std::size_t k = 0; k < meter.t.size() && meter.t[k] <= 0.4 + shown; ++k) {
    const double from = std::max(window_start(meter, k), 0.4 - before);
    if (meter.t[k] <= from) continue;
    t.push_back(from - 0.4);
    i.push_back(meter.value[k]);
  }
  t.push_back(shown);
  i.push_back(i.back());
  current.steps("the 0.4 s meter, 110 V at once", t, i, ours);
  current.reference(printed::i_max, "printed 1.73 A", printed_line);
  return figure;
}

Figure figure_8(const Findings& f) {
  Figure figure("Figure 8: the driver's answer to three steps",
                "Driver voltage after steps of the reference to 2, 4 and 6 V and back to 0");
  figure.x({"t", "s"});
  Panel& panel = figure.panel({"e_{a}", "V"}, 300);
  constexpr Ink inks[] = {Ink::green, Ink::vermilion, Ink::blue};
  for (std::size_t n = 0; n < f.driver_runs.size(); ++n) {
    const auto [t, e] = part(f.driver_runs[n].at(Signal::e_a), 0, 17, 0, 5);
    panel.line(f.driver_runs[n].name, t, e, {.ink = inks[n], .dash = Dash::solid, .marker = Marker::none});
  }
  return figure;
}

Figure figure_11(const Findings& f) {
  Figure figure("Figure 11, continued: fitted to the rising step, judged on the falling one",
                "Measured speed and three models, and what each leaves");
  figure.x({"t", "s"});
  figure.panel({"ω", "rad/s"}, 220);
  figure.panel({"measured - model", "rad/s"}, 180);
  Panel &speed = figure.panels[0], &left = figure.panels[1];
  const Series& omega = f.both.at(Signal::omega);
  const auto [t, w] = part(omega, 0, omega.t.back(), 0, 5);
  speed.line("measured", t, w, measured);
  const auto add = [&](const std::string& name, const Model& model, const Pen& pen) {
    const std::vector<double> simulated = simulated_speed(f.both, model);
    std::vector<double> y, residual;
    for (std::size_t k = 0; k < simulated.size(); k += 5) {
      y.push_back(simulated[k]);
      residual.push_back(omega.value[k] - simulated[k]);
    }
    speed.line(name, t, y, pen);
    left.line("", t, residual, pen);
  };
  const auto& m = f.bench.plant.motor;
  add("estimated: no dry friction", linear_model(m.R_a, m.K_b, m.K_m, m.B, m.J),
      {.ink = Ink::vermilion, .marker = Marker::none});
  add("B and J fitted to the rising step", f.both_parameters.model, {.ink = Ink::green, .marker = Marker::none});
  add("with T_{c}, fitted to the rising step", f.with_friction_rising.model,
      {.ink = Ink::blue, .marker = Marker::none});
  const double falls = 12;
  speed.shade(falls, t.back(), "not fitted");
  left.shade(falls, t.back());
  return figure;
}

Figure inertias(const Findings& f) {
  Figure figure("Section 3.4: J by six methods", "Moment of inertia by each method, with the true value");
  std::vector<std::string> names;
  std::vector<double> J, place, low, high;
  for (const InertiaCase& c : f.inertias) {
    names.push_back(c.name);
    J.push_back(1e3 * c.J);
    low.push_back(1e3 * (c.J - 2 * c.std_error));
    high.push_back(1e3 * (c.J + 2 * c.std_error));
    place.push_back(static_cast<double>(place.size()));
  }
  figure.x({.label = "J", .unit = "g m²", .min = 0, .max = 4.5});
  Panel& panel = figure.panel({.label = "", .unit = "", .categories = names}, 190);
  panel.intervals("±2 standard errors", J, place, low, high, {.ink = Ink::blue});
  panel.vertical_reference(1e3 * f.bench.plant.motor.J, "true");
  return figure;
}

}  // namespace

std::vector<std::pair<std::string, Figure>> pictures(const Findings& f) {
  std::vector<std::pair<std::string, Figure>> all;
  all.emplace_back("figure_4", with_printed(f.equation_6, "Figure 4: armature resistance and back-EMF constant",
                                            printed::K_b, printed::R_a));
  all.emplace_back("figure_5",
                   with_printed(f.brake_line, "Figure 5: torque against speed, brake set once, voltage lowered",
                                printed::B, printed::T_L));
  all.emplace_back("figure_6",
                   with_printed(f.torque_constant, "Figure 6: torque against current, brake turned up at 110 V",
                                printed::K_m, -printed::T_0));
  all.emplace_back("figure_7", figure_7(f));
  all.emplace_back("figure_8", figure_8(f));
  all.emplace_back("figure_11", figure_11(f));
  all.emplace_back("inertia", inertias(f));
  return all;
}

}  // namespace emtb::paper
