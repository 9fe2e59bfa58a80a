#include "analysis/estimate/inertia.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/estimate/stretches.h"
#include "analysis/numerics/regression.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr double fast_window = 0.1;        // [s] over which a fast current is averaged
constexpr double coasting_cell = 0.2;      // [s]
constexpr double edge = 5;                 // readings to each side of an instant, whose speed is a line's through them
constexpr double collinear = 0.98;         // share of the acceleration that the speed explains
constexpr double longest_switching = 0.2;  // of the speed's rise: what a contactor takes, and a driver does not

double largest(const Series& series) {
  double most = 0;
  for (const double x : series.value) most = std::max(most, std::abs(x));
  return most;
}

/// The first time at which the signal has passed this share of its way from rest to its largest value.
double passes(const Series& series, double level) {
  for (std::size_t k = 0; k < series.t.size(); ++k) {
    if (std::abs(series.value[k]) >= level) return series.t[k];
  }
  return series.t.back();
}

/// The first time after `from` from which the signal stays above the level until it reaches `until`.
double leaves(const Series& series, double level, double until) {
  double t = 0;
  for (std::size_t k = 0; k < series.t.size() && series.t[k] < until; ++k) {
    if (std::abs(series.value[k]) < level) t = series.t[k];
  }
  return t;
}

std::string needs_k_m() { return "needs K_m. Give --model FILE, or record e_a too: K_b of the armature is K_m"; }

double quotient_error(double value, double relative_a, double relative_b) {
  return std::abs(value) * std::hypot(relative_a, relative_b);
}

}  // namespace

StaticEstimate estimate_switch_on(std::span<const Run> runs, const KnownParameters& known) {
  StaticEstimate result{.what = "inertia", .method = "switch_on", .title = "J = K_m i_max / (dω/dt)_0, as section 3.4"};
  result.x_label = "t from 5 % of the speed";
  result.x_unit = "s";
  result.y_label = "ω";
  result.y_unit = "rad/s";
  double slope = 0, slope_error = 0, i_max = 0, i_error = 0, window = 0;
  std::string why =
      "needs a run that starts at rest under full voltage, with i_a and omega. Close a contactor on the "
      "full voltage, past the driver";
  for (const Run& run : runs) {
    if (!run.has(Signal::omega) || is_sparse(run, Signal::omega)) {
      result.left_out.push_back({{run.name, 0, run.duration()}, "omega is missing or too slow"});
      continue;
    }
    const Series& omega = run.at(Signal::omega);
    const double top = largest(omega);
    const double half = passes(omega, top / 2), start = leaves(omega, 0.05 * top, half);
    if (std::abs(omega.value.front()) > turning * top || top == 0) {
      result.left_out.push_back({{run.name, 0, half}, "does not start at rest"});
      continue;
    }
    EstimateSeries shown{.name = run.name, .joined = true};
    const double shown_to = half + 4 * (half - start);
    const auto every = std::max<std::size_t>(1, omega.t.size() / 4000);
    for (std::size_t k = 0; k < omega.t.size() && omega.t[k] <= shown_to; k += every) {
      if (omega.t[k] < start - 0.1) continue;
      shown.x.push_back(omega.t[k] - start);
      shown.y.push_back(omega.value[k]);
    }
    result.series.push_back(std::move(shown));
    if (!run.has(Signal::i_a)) {
      result.left_out.push_back({{run.name, start, half}, "no i_a"});
      continue;
    }
    if (run.has(Signal::e_a)) {
      const Series& e = run.at(Signal::e_a);
      const double full = largest(e), there = passes(e, 0.9 * full), begun = passes(e, 0.1 * full);
      if (there - begun > longest_switching * (half - start)) {
        const LocalLine rise = local_line(e, begun, there);
        result.left_out.push_back({{run.name, begun, there},
                                   "the voltage takes " + shortest(std::round(100 * (there - begun)) / 100) + " s"});
        why = "the voltage rises at " + shortest(std::round(10 * rise.slope) / 10) +
              " V/s, so the motor follows the driver and accelerates no faster than that over K_b. Close a contactor "
              "on the full voltage, past the driver; or use coast-down, or acceleration";
        continue;
      }
    }
    // A cubic through the first half of the rise: its slope where the speed was zero. An exponential bends too much for
    // a line (half the slope at the end of that half) or a parabola (5 % off at its start).
    std::vector<double> one, t, t2, t3, w;
    const auto at_half = static_cast<std::size_t>(std::ranges::lower_bound(omega.t, half) - omega.t.begin());
    const double sign = omega.value[at_half] < 0 ? -1 : 1;
    for (std::size_t k = 0; k <= at_half; ++k) {
      if (omega.t[k] <= start) continue;
      const double after = omega.t[k] - start;
      one.push_back(1);
      t.push_back(after);
      t2.push_back(after * after);
      t3.push_back(after * after * after);
      w.push_back(sign * omega.value[k]);
    }
    if (t.size() < 8) {
      result.left_out.push_back({{run.name, start, half}, "fewer than eight readings of omega in the rise"});
      continue;
    }
    const Regression cubic = regress(std::array{one, t, t2, t3}, w);
    const std::vector<double>& c = cubic.value;
    double zero = 0;  // back from 5 % of the top to zero, by Newton's method
    const auto rate = [&] { return c[1] + zero * (2 * c[2] + zero * 3 * c[3]); };
    for (int n = 0; n < 8; ++n) zero -= (c[0] + zero * (c[1] + zero * (c[2] + zero * c[3]))) / rate();
    const double at_zero = rate();
    if (at_zero <= slope) continue;  // the hardest start of all counts
    slope = at_zero;
    slope_error = cubic.std_error[1];
    const Series& current = run.at(Signal::i_a);
    i_max = largest(current);
    i_error = lsb_of(current) / std::sqrt(12);
    window = current.window;
    if (window == 0 && is_sparse(run, Signal::i_a))
      window = (current.t.back() - current.t.front()) / static_cast<double>(current.t.size() - 1);
    result.used = {{run.name, start, half}};
    result.points = t.size();
    result.r_squared = cubic.r_squared;
  }
  if (slope == 0) {
    result.lacking = why;
    return result;
  }
  result.quantities = {{"i_max", i_max, i_error, "A"}, {"dω/dt", slope, slope_error, "rad/s2"}};
  if (!known.K_m) {
    result.lacking = needs_k_m();
    return result;
  }
  const double torque = known.K_m->value * i_max;
  const double J = torque / slope;
  const double relative = std::hypot(known.K_m->std_error / known.K_m->value, i_error / i_max);
  result.quantities.push_back({"J", J, quotient_error(J, relative, slope_error / slope), "kg m2"});
  result.remarks.push_back("K_m = " + known.K_m_from);
  if (known.T_c) {
    const double net = (torque - known.T_c->value) / slope;
    result.quantities.push_back({"J_net", net, quotient_error(net, relative, slope_error / slope), "kg m2"});
    result.remarks.push_back("J_net: less T_c = " + known.T_c_from);
  }
  if (window > 0) {
    result.remarks.push_back("i_a is averaged over " + shortest(std::round(1000 * window) / 1000) +
                             " s: the true peak is higher, and J with it. acceleration allows for that");
  }
  return result;
}

StaticEstimate estimate_acceleration(std::span<const Run> runs, const KnownParameters& known) {
  StaticEstimate result{.what = "inertia",
                        .method = "acceleration",
                        .title = "K_m i_a - torque - B ω - T_c = J dω/dt, as means over windows"};
  result.x_label = "Δω / Δt";
  result.x_unit = "rad/s²";
  result.y_label = "K_{m} i_{a} - torque - B ω - T_{c}";
  result.y_unit = "N m";
  std::vector<double> acceleration, speed, one, torque;
  for (const Run& run : runs) {
    if (!run.has(Signal::i_a) || !run.has(Signal::omega) || is_sparse(run, Signal::omega)) {
      result.left_out.push_back({{run.name, 0, run.duration()}, "needs i_a and a fast omega"});
      continue;
    }
    const Series& current = run.at(Signal::i_a);
    const Series& omega = run.at(Signal::omega);
    const double top = largest(omega);
    const bool slow = current.window > 0 || is_sparse(run, Signal::i_a);
    const std::vector<Stretch> open = open_armature(run);
    const double interval = run.duration() / static_cast<double>(omega.t.size());
    const auto add = [&](double from, double to, double i) {
      const double half = std::min(edge * interval, (to - from) / 4);
      if (from < half || to > run.duration() - half || !(to > from)) return;
      for (const Stretch& s : open) {
        if (from < s.to && to > s.from) return;
      }
      if (mean_over(omega, from - half, from).value <= turning * top) return;  // dry friction is not T_c at rest
      const LocalLine first = local_line(omega, from - half, from + half),
                      last = local_line(omega, to - half, to + half);
      const double mean = mean_over(omega, from, to).value;
      if (std::min({first.value, last.value, mean}) <= turning * top) return;
      acceleration.push_back((last.value - first.value) / (to - from));
      speed.push_back(mean);
      one.push_back(1);
      torque.push_back((known.K_m ? known.K_m->value : 1) * i);
      if (run.has(Signal::torque)) torque.back() -= mean_over(run.at(Signal::torque), from, to).value;
    };
    const std::size_t before = torque.size();
    if (slow) {
      for (std::size_t k = 1; k < current.t.size(); ++k) add(window_start(current, k), current.t[k], current.value[k]);
    } else {
      for (double t = 0; t + fast_window <= run.duration(); t += fast_window) {
        const Mean i = mean_over(current, t, t + fast_window);
        if (i.readings > 0) add(t, t + fast_window, i.value);
      }
    }
    if (torque.size() > before) {
      result.used.push_back({run.name, 0, run.duration()});
    } else {
      result.left_out.push_back({{run.name, 0, run.duration()}, "nothing turns forwards"});
    }
  }
  result.points = torque.size();
  const auto [slowest, fastest] = std::ranges::minmax(acceleration.empty() ? std::vector{0.0} : acceleration);
  if (torque.size() < 6 || !(fastest - slowest > 1)) {
    result.series.push_back({.name = "windows", .x = acceleration, .y = torque});
    result.lacking = "needs six or more readings of i_a in motion, some of them while the speed changes, here are " +
                     std::to_string(torque.size()) + ". Run up and down: steps of 0.5 s or more";
    return result;
  }
  // One rise to one speed: the acceleration follows from the speed, and three parameters from two numbers do not.
  const bool alike = regress(std::array{speed, one}, acceleration).r_squared > collinear;
  std::vector<double> friction(torque.size());
  Regression fit;
  if (alike) {
    for (std::size_t k = 0; k < torque.size(); ++k) {
      friction[k] = known.T_c && known.B ? known.T_c->value + known.B->value * speed[k] : 0;
      torque[k] -= friction[k];
    }
    fit = regress(std::array{acceleration}, torque);
  } else {
    fit = regress(std::array{acceleration, speed, one}, torque);
    for (std::size_t k = 0; k < torque.size(); ++k) torque[k] -= fit.value[1] * speed[k] + fit.value[2];
  }
  result.series.push_back({.name = "windows", .x = acceleration, .y = torque});
  if (!known.K_m) {
    result.lacking = needs_k_m();
    return result;
  }
  if (alike && !(known.T_c && known.B)) {
    result.lacking =
        "the acceleration follows from the speed (one rise to one speed), so J, B and T_c cannot be told "
        "apart. Run up and down to several speeds, or give T_c and B: --model FILE with coulomb_friction";
    return result;
  }
  result.r_squared = fit.r_squared;
  result.quantities = {{"J", fit.value[0], fit.std_error[0], "kg m2"}};
  if (alike) {
    result.remarks.push_back("T_c and B = " + known.T_c_from);
  } else {
    result.quantities.push_back({"B", fit.value[1], fit.std_error[1], "N m s/rad"});
    result.quantities.push_back({"T_c", fit.value[2], fit.std_error[2], "N m"});
  }
  result.line = LineFit{.slope = fit.value[0],
                        .slope_error = fit.std_error[0],
                        .r_squared = fit.r_squared,
                        .scatter = fit.scatter,
                        .points = fit.rows};
  result.remarks.push_back("K_m = " + known.K_m_from);
  return result;
}

StaticEstimate estimate_coast_down(std::span<const Run> runs, const KnownParameters& known) {
  StaticEstimate result{
      .what = "coast-down", .method = "coast_down", .title = "-dω/dt = T_c/J + (B/J) ω with open armature"};
  result.x_label = "ω";
  result.x_unit = "rad/s";
  result.y_label = "-dω/dt";
  result.y_unit = "rad/s²";
  std::vector<LinePoint> points;
  bool braked = false;
  for (const Run& run : runs) {
    const std::vector<Stretch> open = open_armature(run);
    if (open.empty() || !run.has(Signal::omega) || is_sparse(run, Signal::omega)) {
      result.left_out.push_back({{run.name, 0, run.duration()},
                                 open.empty() ? "the armature is never open" : "omega is missing or too slow"});
      continue;
    }
    const Series& omega = run.at(Signal::omega);
    const double top = largest(omega);
    for (const Stretch& stretch : open) {
      result.used.push_back(stretch);
      for (double t = stretch.from; t + coasting_cell <= stretch.to + 1e-9; t += coasting_cell) {
        const LocalLine line = local_line(omega, t, t + coasting_cell);
        if (line.readings < 4 ||
            std::abs(local_line(omega, t + coasting_cell / 2, t + coasting_cell).value) <= turning * top)
          continue;
        const double sign = line.value > 0 ? 1 : -1;
        points.push_back({std::abs(line.value), -sign * line.slope, line.value_error, line.slope_error, 0});
      }
      if (run.has(Signal::torque)) {
        const Mean torque = mean_over(run.at(Signal::torque), stretch.from, stretch.to);
        braked = braked || std::abs(torque.value) > 5 * torque.std_error;
      }
    }
  }
  EstimateSeries shown{.name = "open armature"};
  for (const LinePoint& p : points) {
    shown.x.push_back(p.x);
    shown.y.push_back(p.y);
    shown.y_error.push_back(p.sigma_y);
  }
  result.series.push_back(std::move(shown));
  result.points = points.size();
  if (points.size() < 3) {
    result.lacking =
        "needs a coast-down: open the armature circuit at full speed (column armature_open) and record omega until it "
        "stands";
    return result;
  }
  result.line = fit_line(points);
  result.r_squared = result.line->r_squared;
  const double ratio = result.line->intercept, error = result.line->intercept_error;
  result.quantities = {{"T_c/J", ratio, error, "rad/s2"}, {"B/J", result.line->slope, result.line->slope_error, "1/s"}};
  if (known.T_c && ratio > 0) {
    const double J = known.T_c->value / ratio;
    result.quantities.push_back(
        {"J", J, quotient_error(J, known.T_c->std_error / known.T_c->value, error / ratio), "kg m2"});
    result.remarks.push_back("T_c = " + known.T_c_from);
  } else {
    result.remarks.emplace_back("without T_c from elsewhere (friction, or --model) a coast-down gives ratios only");
  }
  if (braked) result.remarks.emplace_back("the gauge reads a load: the brake counts as friction here");
  return result;
}

}  // namespace emtb
