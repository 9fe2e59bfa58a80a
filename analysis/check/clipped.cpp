#include "analysis/check/clipped.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/check/clipped_voltage.h"
#include "analysis/check/readings.h"
#include "analysis/numerics/equal_readings.h"

namespace emtb {
namespace {

/// How a signal came to a stretch: by how much it rose in each of three pieces before it.
struct Approach {
  double sign;        ///< -1: a rise is a fall
  std::size_t piece;  ///< readings
  double first, middle, last;
};

/// @param before the readings up to the last but one
Approach approach(std::span<const double> before, double sign, std::size_t piece) {
  const auto rise = [&](std::size_t back) {
    const std::size_t end = before.size() - 1 - back * piece;
    return sign * (before[end] - before[end - piece]);
  };
  return {sign, piece, rise(2), rise(1), rise(0)};
}

/// How far a signal would still have risen when it reached a stretch: the sum of the geometric series that its pieces
/// begin. A signal that settles rises less in each.
double rise_to_come(const Approach& a) {
  if (a.last <= 0 || a.middle <= 0 || a.first <= 0) return 0;
  const double ratio = std::clamp(std::max(a.last / a.middle, a.middle / a.first), 0.0, 0.9);
  return a.last * ratio / (1 - ratio);
}

/// For how many readings the top of a wave stays within a step of its height, as the slowing of its rise tells.
double dwell_at_top(const Approach& a, double step) {
  const double slowing = a.middle - a.last;
  return slowing > 0 ? 2 * std::sqrt(2 * step / slowing) * static_cast<double>(a.piece) : 0;
}

/// Had a rise slowed down before it reached a stretch? Of one that is cut off, the last two steps take little longer
/// than they did in the pieces before.
/// @param before all readings before the stretch
bool had_slowed(std::span<const double> before, const Approach& a, double value, double step) {
  constexpr double clearly = 2;
  const double within = 2.5 * step;  // two steps, as written
  const double rate = std::max(a.middle, a.last) / static_cast<double>(a.piece);
  std::size_t near = 0;
  while (near < before.size() && a.sign * (value - before[before.size() - 1 - near]) <= within) ++near;
  return rate > 0 && static_cast<double>(near) > clearly * (1 + 2 * step / rate);
}

/// Whether a stretch at the extreme cuts off a rise.
bool cuts_off(std::span<const double> x, const EqualReadings& s, double sign, double step, double noise) {
  // Pieces so long that each rises clear of the noise; the reading just before the stretch may be cut already.
  for (const std::size_t piece : {1, 2, 4, 8, 16}) {
    if (s.begin < 3 * piece + 2) break;
    const Approach a = approach(x.first(s.begin - 1), sign, piece);
    const double left = sign * (s.value - x[s.begin - 2]);
    if (a.last < 6 * std::max(noise, step)) continue;
    if (had_slowed(x.first(s.begin), a, s.value, std::max(noise, step))) continue;
    constexpr double spare = 1.5;  // a rise is known to a step
    if (static_cast<double>(s.length()) < spare * dwell_at_top(a, step)) continue;
    const double reach = a.last / static_cast<double>(piece) * static_cast<double>(s.length());  // had it gone on
    return std::min(rise_to_come(a), reach) >
           3 * std::max(left, 0.0) + 6 * std::max(noise, step) + step;  // read to a step
  }
  return false;
}

/// Does a signal pass this stretch as the top of a wave? A parabola stays within a step of its top for 2/5 as long
/// again on either side; what is cut off rises and falls there as fast as ever.
bool tops_a_wave(std::span<const double> x, const EqualReadings& s, double sign, double step) {
  constexpr double share = 1.0 / 3;  // of the stretch, on both sides together
  const auto near = [&](double reading) { return sign * (s.value - reading) <= 2 * step; };
  std::size_t before = 0, after = 0;
  while (before < s.begin && near(x[s.begin - 1 - before])) ++before;
  while (s.end + after < x.size() && near(x[s.end + after])) ++after;
  return before > 0 && after > 0 && static_cast<double>(before + after) > share * static_cast<double>(s.length());
}

/// Does a stretch begin and end with a jump of what drives the motor? Then it is that which holds the signal there: a
/// controller that raises the voltage as the motor speeds up keeps its current.
bool made_by_input(const Run& run, const Series& series, Signal signal, const EqualReadings& s) {
  constexpr double at_begin = 0.2, at_end = 0.05;  // of the input's largest value, from row to row
  const auto jumps = [&](double time, double share) {
    return std::ranges::any_of(std::array{Signal::u_ref, Signal::e_a}, [&](Signal input) {
      if (input == signal || !run.has(input)) return false;
      const Series& u = run.at(input);
      const auto at = static_cast<std::size_t>(std::ranges::lower_bound(u.t, time) - u.t.begin());
      const double least = share * size_of(u.value);
      for (std::size_t k = std::max<std::size_t>(at, 2) - 1; k < std::min(at + 2, u.value.size()); ++k) {
        if (std::abs(u.value[k] - u.value[k - 1]) > least) return true;
      }
      return false;
    });
  };
  return s.end < series.t.size() && jumps(series.t[s.begin], at_begin) && jumps(series.t[s.end], at_end);
}

/// Did the readings just before a stretch hop beyond their neighbours? A speed of counts that has settled does not, and
/// may come to rest amid a count, however much it hopped on the way there.
bool hopped_before(std::span<const double> x, const EqualReadings& s, double step) {
  constexpr std::size_t just = 24, enough = 4;  // readings; turns
  if (s.begin < just) return true;
  Hops hops;
  for (std::size_t k = s.begin - just + 1; k < s.begin; ++k) hops.add(x[k - 1], x[k], x[k + 1], step);
  return hops.turns < enough || hops.beyond_neighbours();
}

struct Extreme {
  std::size_t readings = 0, first = 0, last = 0;
  std::size_t longest = 0;  ///< of what is no top of a wave, and no rest amid a step
  bool cut = false;
};

Extreme at_extreme(const Run& run, Signal signal, double value, double sign, double step, double noise) {
  const Series& series = run.at(signal);
  const std::span<const double> x = series.value;
  Extreme e;
  for (const EqualReadings& s : equal_readings(x)) {
    if (s.value != value) continue;
    if (e.readings == 0) e.first = s.begin;
    e.readings += s.length();
    e.last = s.end - 1;
    if (tops_a_wave(x, s, sign, step) || made_by_input(run, series, signal, s)) continue;
    const bool of_counts_at_rest = signal == Signal::omega && !hopped_before(x, s, step);
    if (!of_counts_at_rest) e.longest = std::max(e.longest, s.length());
    e.cut = e.cut || (s.length() >= 4 && cuts_off(x, s, sign, step, noise));
  }
  return e;
}

}  // namespace

DataFindings clipped(const Run& run) {
  DataFindings findings;
  for (const Signal signal : measured_signals(run)) {
    if (signal == Signal::theta) continue;  // may rest anywhere
    const Series& series = run.at(signal);
    const std::span<const double> x = series.value;
    const double size = size_of(x);
    const double step = step_of(series);
    const auto [low, high] = std::ranges::minmax(x);
    for (const double sign : {1.0, -1.0}) {
      const double value = sign > 0 ? high : low;
      if (std::abs(value) < 0.1 * size || high - low < 8 * step) continue;  // rests at zero; or a coarse instrument
      // A torque that stands where it stands most of the time is that of a brake.
      if (signal == Signal::torque && 2 * std::ranges::count(x, value) > std::ssize(x)) continue;
      const Restlessness usual = own_restlessness(run, signal, 0.1 * size, value);
      const Extreme e = at_extreme(run, signal, value, sign, step, noise_of(x, 0.1 * size));
      const bool without_noise = usual.noisy && e.longest >= std::max<std::size_t>(12, 10 * usual.length);
      // A driver that ends at its highest voltage, and a dry brake at its highest torque, do so by themselves, unless
      // noise stops there as well.
      const bool may_end = signal == Signal::e_a || signal == Signal::torque;
      const bool ends = without_noise || (may_end ? signal == Signal::e_a && motor_takes_more(run, value) : e.cut);
      if (!ends) continue;
      findings.push_back({run.name, signal, Flaw::clipped, series.t[e.first], series.t[e.last],
                          name_of(signal) + " stops at " + short_number(value) + " " + std::string(info(signal).unit) +
                              " for " + std::to_string(e.readings) +
                              " readings where it would have gone on: widen the range of its input, or leave the span "
                              "out",
                          e.readings >= 10});
    }
  }
  return findings;
}

}  // namespace emtb
