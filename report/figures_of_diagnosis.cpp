#include "report/figures_of_diagnosis.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "figures/number.h"
#include "model/catalogue.h"
#include "report/symbols.h"

namespace emtb {
namespace {

constexpr double nan = std::numeric_limits<double>::quiet_NaN();
constexpr Pen measured_pen{Ink::grey, 2.5, Dash::solid};
constexpr Pen base_pen{Ink::vermilion, 1.5, Dash::dashed};
constexpr Pen final_pen{Ink::blue, 1.5, Dash::solid};
constexpr double band_sigmas = 2;  // 95 % of the readings of a perfect model lie within

Axis axis_of(Signal signal) {
  const std::string unit = printed_unit(info(signal).unit);
  return {
      signal == Signal::torque || signal == Signal::temperature ? std::string(info(signal).name) : symbol_of(signal),
      unit};
}

/// Of what is compared: an angle by its steps.
Axis compared_axis_of(Signal signal) {
  Axis axis = axis_of(signal);
  if (signal == Signal::theta) axis.label = "Δθ";
  return axis;
}

Pen residual_pen(Pen pen) {
  pen.dash = Dash::solid;
  pen.width = 1;
  return pen;
}

/// A curve through the readings; those that are means over a time as level pieces over that time.
struct Curve {
  std::vector<double> t, y;
};
Curve curve(const Overlay& o, const std::vector<double>& values) {
  if (!o.slow) return {o.t, values};
  Curve c;
  for (std::size_t i = 0; i < o.t.size(); ++i) {
    c.t.insert(c.t.end(), {o.from[i], o.t[i], o.t[i]});
    c.y.insert(c.y.end(), {values[i], values[i], nan});
  }
  return c;
}

/// Residuals of one signal and which model each is of, with the noise floor on top of them.
struct NamedResidual {
  std::string model;
  const Overlay* overlay;
  Pen pen;
};
void residual_panel(Figure& figure, const std::vector<NamedResidual>& residuals) {
  const Overlay& last = *residuals.back().overlay;
  Panel& panel = figure.panel({"residual", printed_unit(info(last.signal).unit)}, residuals.size() > 1 ? 110 : 85);
  for (const auto& [model, overlay, pen] : residuals) {
    const Curve residual = curve(*overlay, overlay->residual());
    Pen thin = residual_pen(pen);
    if (overlay->slow) thin.width = 2;
    panel.line(model, residual.t, residual.y, thin);
  }
  std::vector<double> low, high;
  for (const double s : last.sigma) low.push_back(-band_sigmas * s), high.push_back(band_sigmas * s);
  const Curve below = curve(last, low), above = curve(last, high);
  panel.band("noise floor, ±2σ", below.t, below.y, above.y).reference(0, "", {Ink::grey, 0.7, Dash::solid});
}

/// Do two models predict the same, as far as the instrument could tell?
bool same(const Overlay& a, const Overlay& b) {
  for (std::size_t i = 0; i < a.t.size(); ++i) {
    if (std::abs(a.simulated[i] - b.simulated[i]) > 0.05 * a.sigma[i]) return false;
  }
  return true;
}

/// Names of categories with a height that suits their number.
Axis names(std::vector<std::string> list) {
  Axis axis{.label = ""};
  axis.categories = std::move(list);
  return axis;
}
double height_of(std::size_t bars) { return 24 * static_cast<double>(std::max<std::size_t>(bars, 2)) + 6; }

std::vector<double> places(std::size_t n) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = static_cast<double>(i);
  return x;
}

}  // namespace

std::string step_name(const Step& step) {
  if (step.action == "fitted") return "base model";
  return step.action.starts_with("added ") ? "+ " + step.action.substr(6) : step.action;
}

Axis condition_axis(Condition against) {
  switch (against) {
    case Condition::time:
      return {"time", "s"};
    case Condition::direction:
      return {"sign of ω", ""};
    case Condition::acceleration:
      return {"acceleration", "rad/s²"};
    case Condition::angle:
      return {"angle within a turn", "rad"};
    case Condition::heat:
      return {"heat lost in R_a so far", "J"};
    case Condition::current:
      return axis_of(Signal::i_a);
    case Condition::speed:
      return axis_of(Signal::omega);
    case Condition::reference:
      return axis_of(Signal::u_ref);
  }
  return {std::string(name_of(against)), std::string(unit_of(against))};
}

namespace {

/// Measured and simulated, over which the residuals come.
Figure measured_over_simulated(const std::string& run, const Overlay& model, const std::optional<Overlay>& before) {
  const Axis axis = compared_axis_of(model.signal);
  Figure f(run + ": " + axis.label, "Measured " + std::string(info(model.signal).meaning) +
                                        " over its simulation against time, and the residuals with the noise floor.");
  f.x({.label = "time", .unit = "s", .min = 0});
  Panel& top = f.panel(axis, 170);
  const Curve measured = curve(model, model.measured), simulated = curve(model, model.simulated);
  Pen pen = measured_pen;
  if (model.slow) pen.width = 5;
  top.line(model.slow ? "measured, each a mean" : "measured", measured.t, measured.y, pen);
  if (before) {
    const Curve old = curve(*before, before->simulated);
    Pen old_pen = base_pen;
    if (model.slow) old_pen.dash = Dash::solid;  // its pieces are dashes already
    top.line("base model", old.t, old.y, old_pen);
  }
  top.line(before ? "final model" : "model", simulated.t, simulated.y, final_pen);
  return f;
}

}  // namespace

NamedFigure hero_figure(const std::string& run, const Overlay& model, const std::optional<Overlay>& before) {
  Figure f = measured_over_simulated(run, model, before);
  f.wide(560);
  std::vector<NamedResidual> residuals;
  if (before) residuals.push_back({"of the base model", &*before, base_pen});
  residuals.push_back({before ? "of the final model" : "of the model", &model, final_pen});
  residual_panel(f, residuals);
  const std::string caption =
      "Where the base model is furthest off: " + printed((before ? *before : model).floors(), 3) + " noise floors" +
      (before ? ", " + printed(model.floors(), 3) + " with the final model." : ".");
  return {"at_a_glance", std::move(f), caption};
}

NamedFigure overlay_figure(const std::string& run, const Overlay& model, const std::optional<Overlay>& before) {
  Figure f = measured_over_simulated(run, model, before);
  const bool differ = before && !same(*before, model);
  if (differ) residual_panel(f, {{"of the base model", &*before, base_pen}});
  residual_panel(f, {{differ ? "of the final model" : before ? "of both models" : "of the model", &model, final_pen}});
  std::string caption = "Residual: measured − simulated; RMSE ";
  if (differ) caption += printed(before->floors(), 3) + " noise floors with the base model, ";
  caption += printed(model.floors(), 3) + (differ ? " with the final one" : " noise floors") +
             ". Of a perfect model, 95 % of it would lie in the grey band.";
  if (model.signal == Signal::theta)
    caption += " Δθ is how far the shaft turned since the reading before: an angle itself would add up every error.";
  if (model.slow)
    caption +=
        " The meter is slow: each piece is one reading, as long as the time it averages, beside the simulation's mean "
        "over the same time.";
  return {file_name(std::string(info(model.signal).name) + "_of_" + run), std::move(f), caption};
}

std::vector<NamedFigure> residual_map_figures(Signal signal, const Diagnosis& d) {
  std::vector<NamedFigure> figures;
  const bool changed = !d.missing.empty();
  const Axis axis = compared_axis_of(signal);
  const auto sigma = d.signals.find(signal);
  for (const ResidualMap& base : d.where) {
    if (base.signal != signal || base.bins.size() < 2) continue;
    const Axis condition = condition_axis(base.against);
    Figure f(axis.label + " against " + condition.label,
             "Mean residual of " + axis.label + " in bins of " + condition.label + ".");
    f.wide(330).x(condition);
    Panel& p = f.panel({"mean residual", axis.unit}, 120);
    if (sigma != d.signals.end()) {
      const double s = sigma->second.noise.sigma;
      const double room = 0.03 * (base.bins.back() - base.bins.front());
      p.band("", {base.bins.front() - room, base.bins.back() + room}, {-s, -s}, {s, s});
    }
    p.reference(0, "", {Ink::grey, 0.7, Dash::solid});
    const bool joined = base.against != Condition::direction;  // its places are apart
    const auto draw = [&](const ResidualMap& m, const std::string& name, const Pen& pen) {
      if (joined) p.line(name, m.bins, m.mean, pen);
      std::vector<double> low, high;
      for (std::size_t b = 0; b < m.bins.size(); ++b) {
        low.push_back(m.mean[b] - normal_95 * m.std_error[b]);
        high.push_back(m.mean[b] + normal_95 * m.std_error[b]);
      }
      p.points_with_errors(name, m.bins, m.mean, low, high, pen);
    };
    draw(base, changed ? "base" : "", changed ? base_pen : final_pen);
    for (const ResidualMap& after : d.where_final) {
      if (!changed || after.signal != signal || after.against != base.against) continue;
      draw(after, "final", final_pen);
    }
    figures.push_back(
        {file_name("residual_" + std::string(info(signal).name) + "_against_" + std::string(name_of(base.against))),
         std::move(f), ""});
  }
  return figures;
}

NamedFigure parameter_figure(const Diagnosis& d) {
  struct Side {
    std::vector<double> x, y, left, right;
  } base, final;
  std::vector<std::string> list;
  bool far = false;
  const std::vector<std::string> base_names = d.base.names(), final_names = d.final.names();
  const std::vector<double> base_values = d.base.values(), final_values = d.final.values();
  for (std::size_t i = 0; i < final_names.size(); ++i) {
    const Parameter& p = d.final.at(i);
    if (!p.std_error || final_values[i] == 0) continue;
    const double place = static_cast<double>(list.size()), unit = final_values[i];
    list.push_back(symbol_of(final_names[i]));
    const double apart = d.missing.empty() ? 0 : 0.14;  // the two do not cover each other
    const auto put = [&](Side& side, double value, std::optional<double> error) {
      const double half = normal_95 * error.value_or(0) / std::abs(unit);
      side.x.push_back(value / unit);
      side.y.push_back(&side == &base ? place - apart : place + apart);
      side.left.push_back(value / unit - half);
      side.right.push_back(value / unit + half);
      far = far || value / unit > 3;
    };
    const auto in_base = std::ranges::find(base_names, final_names[i]);
    if (in_base != base_names.end() && !d.missing.empty()) {
      const auto j = static_cast<std::size_t>(in_base - base_names.begin());
      put(base, base_values[j], d.base.at(j).std_error);
    }
    put(final, unit, *p.std_error);
  }
  far = far && std::ranges::all_of(final.left, [](double x) { return x > 0; }) &&
        std::ranges::all_of(base.left, [](double x) { return x > 0; });
  Figure f("95 % intervals, relative to the value of the final model",
           "Each parameter's value and interval divided by its value in the final model.");
  f.x({.label = "value / value of the final model", .log = far});
  Panel& p = f.panel(names(list), height_of(list.size()));
  p.vertical_reference(1, "");
  if (!base.x.empty()) p.intervals("base model", base.x, base.y, base.left, base.right, {Ink::vermilion});
  p.intervals(d.missing.empty() ? "model" : "final model", final.x, final.y, final.left, final.right, {Ink::blue});
  return {
      "parameters", std::move(f),
      "A bar wider than its marker is a parameter that these data know poorly. Where the base model's interval does "
      "not reach the final one's, the base model's parameter had taken up what was missing."};
}

NamedFigure promise_figure(const Diagnosis& d) {
  std::vector<std::string> list, labels;
  std::vector<double> drops;
  std::vector<Candidate> candidates = d.candidates;
  std::ranges::stable_sort(candidates, std::ranges::greater{},
                           [](const Candidate& c) { return c.score.predicted_drop; });
  for (const Candidate& c : candidates) {
    const EffectInfo& e = d.about(c.score.effect);
    list.push_back(d.id(c.score.effect));
    drops.push_back(std::max(1.0, c.score.predicted_drop));
    std::string label = "< 1";
    if (c.score.predicted_drop >= 1) {
      label = printed(c.score.predicted_drop, 3);
      const std::string unit = printed_unit(e.parameter_list[0].unit);
      if (!c.score.expected().empty())
        label += ": " + symbol_of(std::string(e.parameter_list[0].symbol)) + " = " + printed(c.score.expected()[0], 3) +
                 (unit.empty() ? "" : " " + unit);
    }
    labels.push_back(label);
  }
  Figure f("What each absent effect promises", "Predicted drop of the sum of squares for each effect, largest first.");
  f.x({.label = "predicted drop of the sum of squares", .unit = "σ²", .log = true, .min = 1});
  f.panel(names(list), height_of(list.size())).horizontal_bars("", drops, places(drops.size())).labels(labels);
  return {
      "candidates_predicted_drop", std::move(f),
      "Each effect was scored without a refit, at the model that did not yet have it: by how much it would lower the "
      "sum of squares (in units of the noise variance), and the size it would come out at. Effects that imitate each "
      "other promise much alike; the refits below decide."};
}

NamedFigure refit_figure(const Diagnosis& d) {
  std::vector<std::string> list, labels;
  std::vector<double> errors;
  for (const Candidate& c : d.candidates) {
    if (!c.held_out_error) continue;
    list.push_back(d.id(c.score.effect));
    errors.push_back(*c.held_out_error);
    labels.push_back(printed(*c.held_out_error, 3));
  }
  Figure f("Held-out error once refitted", "Error on held-out runs of the best refit that had each effect.");
  f.x({.label = "held-out error", .unit = "noise floors", .with_zero = true});
  f.panel(names(list), height_of(list.size()))
      .horizontal_bars("", errors, places(errors.size()))
      .labels(labels)
      .vertical_reference(1, "", {Ink::grey, 1, Dash::dashed})
      .vertical_reference(d.base_held_out, "base model", {Ink::vermilion, 1.5, Dash::dashed});
  return {"candidates_held_out_error", std::move(f),
          "The most promising effects were refitted with all parameters free. A bar that reaches the line of the base "
          "model removed nothing that held-out runs would show."};
}

NamedFigure staircase_figure(const Diagnosis& d) {
  std::vector<std::string> list, labels;
  std::vector<double> train, held;
  for (const Step& s : d.steps) {
    list.push_back(step_name(s));
    train.push_back(s.train);
    held.push_back(s.held_out);
    labels.push_back(printed(s.held_out, 3));
  }
  const std::vector<double> x = places(list.size());
  Figure f("Error from step to step", "Error on training and held-out runs after each step, in noise floors.");
  f.wide(std::clamp(170.0 * static_cast<double>(list.size()) + 120, 420.0, 820.0)).x(names(list));
  Panel& p = f.panel({.label = "error", .unit = "noise floors", .log = true, .with_zero = true}, 210);
  p.reference(1, "noise floor");
  const Pen grey{.ink = Ink::grey, .dash = Dash::dotted, .marker = Marker::square, .size = 4};
  const Pen blue{.ink = Ink::blue, .size = 4};
  if (!d.judged_on_training) p.line("training runs", x, train, grey).points("training runs", x, train, grey);
  const std::string name = d.judged_on_training ? "the one run"
                           : d.left_one_out     ? "each run held out in turn"
                                                : "held-out runs";
  p.line(name, x, held, blue).points(name, x, held, blue).labels(labels);
  return {
      "error_steps", std::move(f),
      "Error: root of the mean over the signals of (RMSE/σ)², on a logarithmic axis; 1 is the noise floor, below which "
      "no model can get but by chance. Held-out runs take no part in any fit: what falls there is understood, not "
      "learned by heart."};
}

NamedFigure missing_figure(const MissingCurve& base, const std::optional<MissingCurve>& after) {
  const Axis condition = axis_of(*signal_named(base.against));
  Figure f("Missing " + base.quantity + " against " + condition.label,
           "The " + base.quantity + " that the equations lack, with its 95 % band.");
  f.wide(600).x({condition.label, printed_unit(base.against_unit)});
  Panel& p = f.panel({"missing " + base.quantity, printed_unit(base.unit)}, 180);
  p.reference(0, "", {Ink::grey, 0.7, Dash::solid});
  const auto draw = [&](const MissingCurve& c, const std::string& name, const Pen& pen) {
    std::vector<double> low, high;
    for (std::size_t i = 0; i < c.x.size(); ++i) {
      low.push_back(c.value[i] - normal_95 * c.std_error[i]);
      high.push_back(c.value[i] + normal_95 * c.std_error[i]);
    }
    p.band("", c.x, low, high, pen).line(name, c.x, c.value, pen).points(name, c.x, c.value, pen);
  };
  draw(base, after ? "base model" : "model", after ? base_pen : final_pen);
  if (after) draw(*after, "final model", final_pen);
  return {file_name("missing_" + base.quantity + "_against_" + base.against), std::move(f),
          "What would have to be added to the equations for them to hold, with its 95 % band, without naming an "
          "effect. Zero "
          "throughout: nothing is missing. A step at ω = 0 is dry friction, a slope is viscous, a parabola is air."};
}

NamedFigure raw_figure(const Run& whole, std::span<const UsedSpan> spans) {
  Figure f(short_name(whole.name) + ": as recorded", "All recorded signals against time.");
  f.x({"time", "s"});
  const double duration = whole.duration();
  for (const auto& [signal, series] : whole.signals) {
    Axis axis = axis_of(signal);
    if (signal == Signal::armature_open) axis.min = -0.2, axis.max = 1.2;
    Panel& p = f.panel(axis, 62);
    const bool slow = is_sparse(whole, signal) || series.window > 0;
    if (slow) {
      Curve c;
      for (std::size_t k = 0; k < series.t.size(); ++k) {
        c.t.insert(c.t.end(), {window_start(series, k), series.t[k], series.t[k]});
        c.y.insert(c.y.end(), {series.value[k], series.value[k], nan});
      }
      p.line("", c.t, c.y, {Ink::ink, 2, Dash::solid});
    } else if (signal == Signal::u_ref || signal == Signal::armature_open) {
      p.steps("", series.t, series.value, {Ink::ink, 1, Dash::solid});
    } else {
      p.line("", series.t, series.value, {Ink::ink, 1, Dash::solid});
    }
    for (const UsedSpan& s : spans) {
      if (s.from <= 0 && s.to >= duration && spans.size() == 1) continue;
      p.shade(s.from, std::min(s.to, duration), f.panels.size() == 1 ? s.label : "");
    }
  }
  return {file_name("recorded_" + short_name(whole.name)), std::move(f), ""};
}

}  // namespace emtb
