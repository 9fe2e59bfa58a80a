#include "analysis/estimate/driver_steps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/estimate/stretches.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr double a_step = 0.02;             // of the largest reference
constexpr double a_transition = 0.05;       // of the largest voltage
constexpr double shortest_hold = 0.3;       // [s]
constexpr std::size_t enough_to_bend = 20;  // readings: the ends of a transition fall between two
constexpr double bent = 0.15;               // difference of the two halves' slopes that a slew limit does not show

/// A change of e_a that a step of u_ref causes.
struct Transition {
  Stretch where;            ///< between 10 and 90 % of the way
  double from = 0, to = 0;  ///< [V]
  double step = 0;          ///< [s] when u_ref stepped
  LocalLine line;
  bool bends = false;  ///< slower towards its end
};

/// The times at which the reference jumps, and the end of the run.
std::vector<double> jumps(const Series& u) {
  double largest = 0;
  for (const double x : u.value) largest = std::max(largest, std::abs(x));
  std::vector<double> times;
  for (std::size_t k = 1; k < u.t.size(); ++k) {
    if (std::abs(u.value[k] - u.value[k - 1]) > a_step * largest) times.push_back(u.t[k]);
  }
  times.push_back(u.t.back());
  return times;
}

double passes(const Series& e, double from, double level, bool up) {
  auto k = static_cast<std::size_t>(std::ranges::lower_bound(e.t, from) - e.t.begin());
  while (k + 1 < e.t.size() && (up ? e.value[k] < level : e.value[k] > level)) ++k;
  return e.t[k];
}

std::vector<Transition> transitions(const Run& run, StaticEstimate& result) {
  const Series& e = run.at(Signal::e_a);
  const std::vector<double> times = jumps(run.at(Signal::u_ref));
  double largest = 0;
  for (const double x : e.value) largest = std::max(largest, std::abs(x));
  const std::vector<Stretch> open = open_armature(run);
  std::vector<Transition> found;
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    const double t0 = times[k], t1 = times[k + 1];
    if (t1 - t0 < shortest_hold) {
      result.left_out.push_back({{run.name, t0, t1}, "the next step comes too soon"});
      continue;
    }
    const double before = mean_over(e, t0 - 0.1, t0 - 1e-6).value;
    const double after = mean_over(e, t1 - 0.1, t1 - 1e-6).value;
    const bool up = after > before;
    if (std::ranges::any_of(open, [&](const Stretch& s) { return t0 < s.to && t1 > s.from; })) {
      result.left_out.push_back({{run.name, t0, t1}, "the armature is open: e_a is not the driver's"});
      continue;
    }
    if (std::abs(after - before) < a_transition * largest) continue;
    const LocalLine end = local_line(e, t1 - 0.1, t1 - 1e-6);
    Transition t{.where = {run.name, passes(e, t0, before + 0.1 * (after - before), up),
                           passes(e, t0, before + 0.9 * (after - before), up)},
                 .from = before,
                 .to = after,
                 .step = t0,
                 .line = {}};
    if (std::abs(end.slope) > 5 * end.slope_error && std::abs(end.slope) * 0.1 > 0.02 * std::abs(after - before)) {
      result.left_out.push_back({{run.name, t0, t1}, "the voltage still moves when the next step comes"});
      continue;
    }
    t.line = local_line(e, t.where.from, t.where.to);
    if (t.line.readings < 4) {
      result.left_out.push_back({{run.name, t0, t1}, "faster than e_a is read"});
      continue;
    }
    const double middle = (t.where.from + t.where.to) / 2;
    const LocalLine first = local_line(e, t.where.from, middle), second = local_line(e, middle, t.where.to);
    t.bends = t.line.readings >= enough_to_bend &&
              std::abs(second.slope) + 3 * second.slope_error < (1 - bent) * std::abs(first.slope);
    found.push_back(t);
  }
  return found;
}

/// Mean slope of several transitions, with the error that their spread shows where that is larger.
Quantity slope_of(const char* symbol, const std::vector<LocalLine>& lines) {
  double weights = 0, sum = 0;
  for (const LocalLine& line : lines) {
    const double w = line.slope_error > 0 ? 1 / (line.slope_error * line.slope_error) : 1;
    weights += w;
    sum += w * line.slope;
  }
  Quantity q{symbol, sum / weights, 1 / std::sqrt(weights), "V/s"};
  if (lines.size() > 1) {
    double squares = 0;
    for (const LocalLine& line : lines) squares += (line.slope - q.value) * (line.slope - q.value);
    const auto n = static_cast<double>(lines.size());
    q.std_error = std::max(q.std_error, std::sqrt(squares / (n - 1) / n));
  }
  if (lines.front().slope_error == 0) q.std_error = 0;
  return q;
}

}  // namespace

StaticEstimate estimate_driver_gain(const Settled& settled) {
  StaticEstimate result{.what = "driver", .method = "driver_gain", .title = "e_a = gain u_ref + offset, settled"};
  result.x_label = "u_{ref}";
  result.x_unit = "V";
  result.y_label = "e_{a}";
  result.y_unit = "V";
  static constexpr std::array needed{Signal::u_ref, Signal::e_a};
  std::vector<LinePoint> points;
  std::vector<const SettledPoint*> candidates = points_with(settled, needed, result);
  std::ranges::sort(candidates, {}, [](const SettledPoint* p) { return p->at(Signal::u_ref); });
  EstimateSeries shown{.name = "settled points"};
  const double top = candidates.empty() ? 0 : std::abs(candidates.back()->at(Signal::e_a));
  // In the dead zone the driver gives nothing, whatever the reference.
  double dead_until = 0;
  for (const SettledPoint* p : candidates) {
    const double u = p->at(Signal::u_ref), e = p->at(Signal::e_a);
    shown.x.push_back(u);
    shown.y.push_back(e);
    shown.y_error.push_back(p->error(Signal::e_a));
    if (std::abs(e) < 0.005 * top) {
      if (u > 0) dead_until = std::max(dead_until, u);
      continue;  // at zero, or in the dead zone: no point of the line
    }
    result.used.push_back(p->where);
    points.push_back({u, e, 0, p->error(Signal::e_a), 0});
  }
  result.series.push_back(std::move(shown));
  // Saturated: several references, one voltage at the upper end.
  while (points.size() > 3) {
    const LinePoint &last = points.back(), &before = points[points.size() - 2];
    if (last.x - before.x < 1e-3 * last.x || last.y - before.y > 0.01 * last.y) break;
    points.pop_back();
    result.left_out.push_back({result.used.back(), "the driver's upper end"});
    result.used.pop_back();
  }
  result.points = points.size();
  const bool spread = !points.empty() && points.back().x - points.front().x > 0.1 * std::abs(points.back().x);
  if (points.size() < 3 || !spread) {
    result.lacking = "needs three or more settled voltages with u_ref and e_a, here are " +
                     std::to_string(points.size()) +
                     ". Run steps to several levels, held until the voltage stands (some seconds)";
    return result;
  }
  result.line = fit_line(points);
  result.r_squared = result.line->r_squared;
  result.quantities = {{"gain", result.line->slope, result.line->slope_error, "V/V"},
                       {"offset", result.line->intercept, result.line->intercept_error, "V"}};
  const double dead = -result.line->intercept / result.line->slope;
  if (dead > 0 && -result.line->intercept > 5 * result.line->intercept_error && dead > 0.005 * points.back().x) {
    result.quantities.push_back({"dead_zone", dead, result.line->intercept_error / result.line->slope, "V"});
    if (dead_until > 0)
      result.remarks.push_back("no voltage at u_ref = " + shortest(std::round(1000 * dead_until) / 1000) + " V");
  } else {
    result.remarks.emplace_back("no dead zone seen");
  }
  return result;
}

StaticEstimate estimate_driver_slopes(std::span<const Run> runs) {
  StaticEstimate result{
      .what = "driver", .method = "driver_slopes", .title = "rise and fall of e_a after steps of u_ref, as figure 8"};
  result.x_label = "t after the step";
  result.x_unit = "s";
  result.y_label = "e_{a}";
  result.y_unit = "V";
  std::vector<LocalLine> up, down;
  bool bends = false;
  for (const Run& run : runs) {
    if (!run.has(Signal::u_ref) || !run.has(Signal::e_a) || is_sparse(run, Signal::e_a)) {
      result.left_out.push_back({{run.name, 0, run.duration()}, "needs u_ref and a fast e_a"});
      continue;
    }
    const Series& e = run.at(Signal::e_a);
    for (const Transition& t : transitions(run, result)) {
      (t.to > t.from ? up : down).push_back(t.line);
      bends = bends || t.bends;
      result.used.push_back(t.where);
      const double show_to = t.where.to + 0.3 * (t.where.to - t.where.from);
      EstimateSeries shown{
          .name = shortest(std::round(t.from) + 0.0) + " to " + shortest(std::round(t.to) + 0.0) + " V",
          .x = {},
          .y = {},
          .y_error = {},
          .joined = true};
      const auto every = std::max<std::size_t>(1, e.t.size() / 4000);
      for (std::size_t k = 0; k < e.t.size() && e.t[k] <= show_to; k += every) {
        if (e.t[k] < t.step - 0.2) continue;
        shown.x.push_back(e.t[k] - t.step);
        shown.y.push_back(e.value[k]);
      }
      result.series.push_back(std::move(shown));
    }
  }
  result.points = up.size() + down.size();
  if (up.empty() && down.empty()) {
    result.lacking =
        "needs steps of u_ref with e_a read at least ten times during each transition, held until the "
        "voltage stands. Run steps to several levels and back";
    return result;
  }
  result.r_squared = 1;
  if (!up.empty()) result.quantities.push_back(slope_of("rise", up));
  if (!down.empty()) result.quantities.push_back(slope_of("fall", down));
  if (bends) result.remarks.emplace_back("the transitions bend: more a lag than a limit of slope");
  return result;
}

}  // namespace emtb
