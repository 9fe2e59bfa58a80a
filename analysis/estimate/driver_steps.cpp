#include "analysis/estimate/driver_steps.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "session/text.h"

namespace emtb {
namespace {

// By hand, each held by the tests Driver.* and by figure 8 of docs/paper.md.
constexpr double a_step = 0.02;             // of the largest reference
constexpr double a_transition = 0.05;       // of the largest voltage
constexpr double shortest_hold = 0.3;       // [s] between steps: three means of 0.1 s
constexpr double beside_a_step = 0.1;       // [s] whose mean is the voltage before it
constexpr double just_before = 1e-6;        // [s] not the reading of the step itself
constexpr double still_moves = 0.02;        // of a transition, within that mean
constexpr double low = 0.1, high = 0.9;     // of the way, as a rise time is defined
constexpr std::size_t fewest = 4;           // readings of a transition: twice what its line fits
constexpr std::size_t enough_to_bend = 20;  // readings: the ends of a transition fall between two
constexpr double bent = 0.15;               // difference of the two halves' slopes that a slew limit does not show
constexpr double clearly_bent = 3;          // standard errors beyond that

// Of the static characteristic, by hand; Driver.ItsGainDeadZoneAndSlopesAreFound holds them.
constexpr double no_voltage = 0.005;  // of the largest: in the dead zone
constexpr double same_input = 1e-3;   // of the reference: the same level again
constexpr double same_output = 0.01;  // of the voltage: at the driver's upper end
constexpr double least_spread = 0.1;  // of the largest reference: less is one level measured several times
constexpr double least_dead = 0.005;  // of the largest reference: less is no dead zone

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
  const double largest = largest_size(u);
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

/// Do the halves of a transition differ as those of a lag do?
bool bends(const Series& e, const Transition& t) {
  if (t.line.readings < enough_to_bend) return false;
  const double middle = (t.where.from + t.where.to) / 2;
  const LocalLine first = local_line(e, t.where.from, middle), second = local_line(e, middle, t.where.to);
  return std::abs(second.slope) + clearly_bent * second.slope_error < (1 - bent) * std::abs(first.slope);
}

/// What the voltage does between two steps of the reference.
struct Answer {
  std::optional<Transition> transition = {};
  const char* left_out = nullptr;  ///< why it is none; null: the voltage hardly changes
};

/// @param step the reference's, and the next one
Answer answer_to(const Stretch& step, const Series& e, std::span<const Stretch> open) {
  const double t0 = step.from, t1 = step.to;
  if (t1 - t0 < shortest_hold) return {.left_out = "the next step comes too soon"};
  const double before = mean_over(e, t0 - beside_a_step, t0 - just_before).value;
  const double after = mean_over(e, t1 - beside_a_step, t1 - just_before).value;
  const bool up = after > before;
  if (std::ranges::any_of(open, [&](const Stretch& s) { return t0 < s.to && t1 > s.from; })) {
    return {.left_out = "the armature is open: e_a is not the driver's"};
  }
  if (std::abs(after - before) < a_transition * largest_size(e)) return {};
  Transition t{.where = {step.run, passes(e, t0, before + low * (after - before), up),
                         passes(e, t0, before + high * (after - before), up)},
               .from = before,
               .to = after,
               .step = t0,
               .line = {}};
  const LocalLine end = local_line(e, t1 - beside_a_step, t1 - just_before);
  if (std::abs(end.slope) > clear_of_zero * end.slope_error &&
      std::abs(end.slope) * beside_a_step > still_moves * std::abs(after - before)) {
    return {.left_out = "the voltage still moves when the next step comes"};
  }
  t.line = local_line(e, t.where.from, t.where.to);
  if (t.line.readings < fewest) return {.left_out = "faster than e_a is read"};
  t.bends = bends(e, t);
  return {.transition = std::move(t)};
}

std::vector<Transition> transitions(const Run& run, StaticEstimate& result) {
  const Series& e = run.at(Signal::e_a);
  const std::vector<double> times = jumps(run.at(Signal::u_ref));
  const std::vector<Stretch> open = open_armature(run);
  std::vector<Transition> found;
  for (std::size_t k = 0; k + 1 < times.size(); ++k) {
    const Stretch step{run.name, times[k], times[k + 1]};
    Answer answer = answer_to(step, e, open);
    if (answer.left_out) result.left_out.push_back({step, answer.left_out});
    if (answer.transition) found.push_back(std::move(*answer.transition));
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

/// The settled points of the driver, by rising reference.
struct Characteristic {
  std::vector<LinePoint> points;
  double dead_until = 0;  ///< [V] the largest reference that gives no voltage
};

Characteristic characteristic_of(const Settled& settled, StaticEstimate& result) {
  static constexpr std::array needed{Signal::u_ref, Signal::e_a};
  std::vector<const SettledPoint*> candidates = points_with(settled, needed, result.left_out);
  std::ranges::sort(candidates, {}, [](const SettledPoint* p) { return p->at(Signal::u_ref); });
  Characteristic found;
  EstimateSeries shown{.name = "settled points"};
  const double top = candidates.empty() ? 0 : std::abs(candidates.back()->at(Signal::e_a));
  for (const SettledPoint* p : candidates) {
    const LinePoint point{p->at(Signal::u_ref), p->at(Signal::e_a), 0, p->error(Signal::e_a), 0};
    shown.add(point);
    if (std::abs(point.y) < no_voltage * top) {  // at zero, or in the dead zone: no point of the line
      if (point.x > 0) found.dead_until = std::max(found.dead_until, point.x);
      continue;
    }
    result.used.push_back(p->where);
    found.points.push_back(point);
  }
  result.series.push_back(std::move(shown));
  return found;
}

/// Takes away what is saturated: several references, one voltage at the upper end.
void leave_out_upper_end(std::vector<LinePoint>& points, StaticEstimate& result) {
  while (points.size() > 3) {
    const LinePoint &last = points.back(), &before = points[points.size() - 2];
    if (last.x - before.x < same_input * last.x || last.y - before.y > same_output * last.y) break;
    points.pop_back();
    result.left_out.push_back({result.used.back(), "the driver's upper end"});
    result.used.pop_back();
  }
}

void tell_dead_zone(StaticEstimate& result, const LineFit& line, double largest_input, double dead_until) {
  const double dead = -line.intercept / line.slope;
  const bool clear = -line.intercept > clear_of_zero * line.intercept_error;
  if (!(dead > 0 && clear && dead > least_dead * largest_input)) {
    result.remarks.emplace_back("no dead zone seen");
    return;
  }
  result.quantities.push_back({"dead_zone", dead, line.intercept_error / line.slope, "V"});
  if (dead_until > 0)
    result.remarks.push_back("no voltage at u_ref = " + shortest(std::round(1000 * dead_until) / 1000) + " V");
}

std::string whole_volts(double value) { return shortest(std::round(value) + 0.0); }  // + 0: no minus before a zero

}  // namespace

StaticEstimate estimate_driver_gain(const Settled& settled) {
  StaticEstimate result{.method = StaticMethod::driver_gain,
                        .title = "e_a = gain u_ref + offset, settled",
                        .x_label = "u_{ref}",
                        .x_unit = "V",
                        .y_label = "e_{a}",
                        .y_unit = "V"};
  auto [points, dead_until] = characteristic_of(settled, result);
  leave_out_upper_end(points, result);
  result.points = points.size();
  const bool spread = !points.empty() && points.back().x - points.front().x > least_spread * std::abs(points.back().x);
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
  tell_dead_zone(result, *result.line, points.back().x, dead_until);
  return result;
}

StaticEstimate estimate_driver_slopes(std::span<const Run> runs) {
  constexpr double shown_before = 0.2;  // [s] of the step, for the eye
  constexpr double shown_after = 0.3;   // of the transition, for the eye
  StaticEstimate result{.method = StaticMethod::driver_slopes,
                        .title = "rise and fall of e_a after steps of u_ref, as figure 8",
                        .x_label = "t after the step",
                        .x_unit = "s",
                        .y_label = "e_{a}",
                        .y_unit = "V"};
  std::vector<LocalLine> up, down;
  bool any_bends = false;
  for (const Run& run : runs) {
    if (!run.has(Signal::u_ref) || !run.has(Signal::e_a) || is_sparse(run, Signal::e_a)) {
      result.left_out.push_back({{run.name, 0, run.duration()}, "needs u_ref and a fast e_a"});
      continue;
    }
    for (const Transition& t : transitions(run, result)) {
      (t.to > t.from ? up : down).push_back(t.line);
      any_bends = any_bends || t.bends;
      result.used.push_back(t.where);
      const double shown_to = t.where.to + shown_after * (t.where.to - t.where.from);
      result.series.push_back(curve_of(run.at(Signal::e_a), {{}, t.step - shown_before, shown_to}, t.step));
      result.series.back().name = whole_volts(t.from) + " to " + whole_volts(t.to) + " V";
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
  if (any_bends) result.remarks.emplace_back("the transitions bend: more a lag than a limit of slope");
  return result;
}

}  // namespace emtb
