#include "analysis/estimate/switch_on.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/numerics/regression.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr double onset = 0.05;        // of the top speed: the rise has begun. By hand: above a tacho's noise
constexpr std::size_t fewest = 8;     // readings in the rise: twice what the cubic fits
constexpr double shown_before = 0.1;  // [s] for the eye
constexpr double shown_after = 4;     // halves of the rise, for the eye

/// Of half the speed's rise, from 10 to 90 % of the voltage: what a contactor takes, and a driver does not. By hand
/// (docs/decisions/static-estimates.md; SwitchOn.RefusesAStartBehindTheDriver).
constexpr double longest_switching = 0.2;

constexpr const char* needed =
    "needs a run that starts at rest under full voltage, with i_a and omega. Close a contactor on the "
    "full voltage, past the driver";

/// The first time at which the signal is as large as this.
double passes(const Series& series, double level) {
  for (std::size_t k = 0; k < series.t.size(); ++k) {
    if (std::abs(series.value[k]) >= level) return series.t[k];
  }
  return series.t.back();
}

/// The last time before `until` at which the signal is below the level; 0: it never is.
double leaves(const Series& series, double level, double until) {
  double t = 0;
  for (std::size_t k = 0; k < series.t.size() && series.t[k] < until; ++k) {
    if (std::abs(series.value[k]) < level) t = series.t[k];
  }
  return t;
}

/// The first half of a rise from rest; nothing where there is none, which is noted.
std::optional<Stretch> rise_from_rest(const Run& run, StaticEstimate& result) {
  if (!run.has(Signal::omega) || is_sparse(run, Signal::omega)) {
    result.left_out.push_back({{run.name, 0, run.duration()}, "omega is missing or too slow"});
    return std::nullopt;
  }
  const Series& omega = run.at(Signal::omega);
  const double top = largest_size(omega);
  const double half = passes(omega, top / 2);
  if (std::abs(omega.value.front()) > turning * top || top == 0) {
    result.left_out.push_back({{run.name, 0, half}, "does not start at rest"});
    return std::nullopt;
  }
  return Stretch{run.name, leaves(omega, onset * top, half), half};
}

/// Is the full voltage there at once, as far as the run tells? Where not, why not is noted.
bool voltage_is_there(const Run& run, const Stretch& rise, StaticEstimate& result) {
  if (!run.has(Signal::e_a)) return true;
  const Series& e = run.at(Signal::e_a);
  const double full = largest_size(e), there = passes(e, 0.9 * full), begun = passes(e, 0.1 * full);
  if (there - begun <= longest_switching * (rise.to - rise.from)) return true;
  const LocalLine voltage = local_line(e, begun, there);
  result.left_out.push_back(
      {{run.name, begun, there}, "the voltage takes " + shortest(std::round(100 * (there - begun)) / 100) + " s"});
  result.lacking = "the voltage rises at " + shortest(std::round(10 * voltage.slope) / 10) +
                   " V/s, so the motor follows the driver and accelerates no faster than that over K_b. Close a "
                   "contactor on the full voltage, past the driver; or use coast-down, or acceleration";
  return false;
}

/// The acceleration where the speed was zero.
struct Onset {
  double slope = 0, slope_error = 0;  ///< [rad/s2]
  double r_squared = 0;
  std::size_t readings = 0;
};

/// By a cubic through the first half of the rise. An exponential bends too much for a line (half the slope at the end
/// of that half) or a parabola (5 % off at its start).
std::optional<Onset> onset_of(const Series& omega, const Stretch& rise) {
  std::vector<double> one, t, t2, t3, w;
  const auto at_half = static_cast<std::size_t>(std::ranges::lower_bound(omega.t, rise.to) - omega.t.begin());
  const double sign = omega.value[at_half] < 0 ? -1 : 1;
  for (std::size_t k = 0; k <= at_half; ++k) {
    if (omega.t[k] <= rise.from) continue;
    const double after = omega.t[k] - rise.from;
    one.push_back(1);
    t.push_back(after);
    t2.push_back(after * after);
    t3.push_back(after * after * after);
    w.push_back(sign * omega.value[k]);
  }
  if (t.size() < fewest) return std::nullopt;
  const Regression cubic = regress(std::array{one, t, t2, t3}, w);
  const std::vector<double>& c = cubic.value;
  constexpr int steps = 8;  // of Newton's method, back from the onset to zero speed: each doubles the digits
  double zero = 0;
  const auto rate = [&] { return c[1] + zero * (2 * c[2] + zero * 3 * c[3]); };
  for (int n = 0; n < steps; ++n) zero -= (c[0] + zero * (c[1] + zero * (c[2] + zero * c[3]))) / rate();
  return Onset{rate(), cubic.std_error[1], cubic.r_squared, t.size()};
}

/// The highest current, and what it says of itself.
struct Peak {
  double value = 0, std_error = 0;  ///< [A]
  double window = 0;                ///< [s] over which it is averaged
};

Peak peak_of(const Run& run) {
  const Series& current = run.at(Signal::i_a);
  return {largest_size(current), lsb_of(current) / std::sqrt(12), averaging_window(run, Signal::i_a)};
}

void tell_inertia(StaticEstimate& result, const Onset& start, const Peak& peak, const KnownParameters& known) {
  result.quantities = {{"i_max", peak.value, peak.std_error, "A"}, {"dω/dt", start.slope, start.slope_error, "rad/s2"}};
  if (!known.K_m) {
    result.lacking = needs_K_m;
    return;
  }
  const double torque = known.K_m->value * peak.value;
  const double J = torque / start.slope;
  const double relative = std::hypot(known.K_m->std_error / known.K_m->value, peak.std_error / peak.value);
  result.quantities.push_back({"J", J, quotient_error(J, relative, start.slope_error / start.slope), "kg m2"});
  result.remarks.push_back("K_m = " + known.K_m_from);
  if (known.T_c) {
    const double net = (torque - known.T_c->value) / start.slope;
    result.quantities.push_back(
        {"J_net", net, quotient_error(net, relative, start.slope_error / start.slope), "kg m2"});
    result.remarks.push_back("J_net: less T_c = " + known.T_c_from);
  }
  if (peak.window > 0) {
    result.remarks.push_back("i_a is averaged over " + shortest(std::round(1000 * peak.window) / 1000) +
                             " s: the true peak is higher, and J with it. acceleration allows for that");
  }
}

}  // namespace

StaticEstimate estimate_switch_on(std::span<const Run> runs, const KnownParameters& known) {
  StaticEstimate result{.method = StaticMethod::switch_on,
                        .title = "J = K_m i_max / (dω/dt)_0, as section 3.4",
                        .lacking = needed,
                        .x_label = "t from 5 % of the speed",
                        .x_unit = "s",
                        .y_label = "ω",
                        .y_unit = "rad/s"};
  Onset hardest;  // the hardest start of all counts
  Peak peak;
  for (const Run& run : runs) {
    const std::optional<Stretch> rise = rise_from_rest(run, result);
    if (!rise) continue;
    const Series& omega = run.at(Signal::omega);
    const double shown_to = rise->to + shown_after * (rise->to - rise->from);
    result.series.push_back(curve_of(omega, {run.name, rise->from - shown_before, shown_to}, rise->from));
    if (!run.has(Signal::i_a)) {
      result.left_out.push_back({*rise, "no i_a"});
      continue;
    }
    if (!voltage_is_there(run, *rise, result)) continue;
    const std::optional<Onset> start = onset_of(omega, *rise);
    if (!start) {
      result.left_out.push_back({*rise, "fewer than eight readings of omega in the rise"});
      continue;
    }
    if (start->slope <= hardest.slope) continue;
    hardest = *start;
    peak = peak_of(run);
    result.used = {*rise};
    result.points = start->readings;
    result.r_squared = start->r_squared;
  }
  if (hardest.slope == 0) return result;
  result.lacking.clear();
  tell_inertia(result, hardest, peak, known);
  return result;
}

}  // namespace emtb
