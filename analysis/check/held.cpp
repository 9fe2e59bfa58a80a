#include "analysis/check/held.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

#include "analysis/check/angle_speed.h"
#include "analysis/check/readings.h"
#include "analysis/numerics/equal_readings.h"
#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

double mean_of(const Series& y, double from, double to) {
  double sum = 0;
  std::size_t n = 0;
  for (auto k = static_cast<std::size_t>(std::ranges::lower_bound(y.t, from) - y.t.begin());
       k < y.t.size() && y.t[k] <= to; ++k, ++n)
    sum += y.value[k];
  return n > 0 ? sum / static_cast<double>(n) : std::numeric_limits<double>::quiet_NaN();
}

/// Whether another signal goes somewhere else during a stretch: a third of its range between its thirds. A third of
/// this one's has to be several of its steps for that to tell anything. A brake takes one torque at any speed.
bool others_move(const Run& run, Signal held_signal, double from, double to) {
  if (held_signal == Signal::torque) return false;
  constexpr double several = 5;
  const Series& own = run.at(held_signal);
  std::vector<double> sorted = own.value;  // but for the peaks, as of a current that starts the motor
  std::ranges::sort(sorted);
  const double usual = sorted[sorted.size() * 95 / 100] - sorted[sorted.size() * 5 / 100];
  if (0.3 * usual < several * step_of(own)) return false;
  const double third = (to - from) / 3;
  for (const auto& [signal, y] : run.signals) {
    const bool tells =
        signal == Signal::u_ref || signal == Signal::e_a || signal == Signal::i_a || signal == Signal::omega;
    if (!tells || signal == held_signal || is_sparse(run, signal)) continue;
    const auto [low, high] = std::ranges::minmax(y.value);
    const double begin = mean_of(y, from, from + third), middle = mean_of(y, from + third, to - third),
                 end = mean_of(y, to - third, to);
    const double moved = std::max({begin, middle, end}) - std::min({begin, middle, end});
    if (moved > 0.3 * (high - low)) return true;
  }
  return false;
}

/// Whether a motor is driven, and the other way than it turns.
class Driven {
 public:
  Driven(const Run& run, const Series& own) : own_(own) {
    constexpr std::size_t parts = 50;
    const Signal signal = run.has(Signal::u_ref) ? Signal::u_ref : Signal::e_a;
    if (!run.has(signal) || is_sparse(run, signal)) return;
    drive_ = &run.at(signal);
    const double part = (own.t.back() - own.t.front()) / static_cast<double>(parts);
    double with = 0;
    for (std::size_t i = 0; i < parts; ++i) {
      const double begin = own.t.front() + static_cast<double>(i) * part;
      const double product = mean_of(*drive_, begin, begin + part) * mean_of(own, begin, begin + part);
      if (std::isfinite(product)) with += product;
    }
    if (!(with > 0)) drive_ = nullptr;  // the sign of one of them is turned, and tells nothing
  }

  /// Is it driven at all? At rest a sensor may be silent that is not while the brushes work.
  bool at_all(const EqualReadings& s) const {
    constexpr double clearly = 0.1;  // of its largest
    if (drive_ == nullptr) return false;
    return std::abs(mean_of(*drive_, own_.t[s.begin], own_.t[s.end - 1])) > clearly * size_of(drive_->value);
  }

  /// For a part of a stretch, of twenty readings or more.
  bool back_during(const EqualReadings& s) const {
    constexpr double clearly = 0.1;  // of its largest
    constexpr std::size_t most = 12, readings = 20;
    if (drive_ == nullptr) return false;
    const std::size_t parts = std::clamp<std::size_t>(s.length() / readings, 1, most);
    const double from = own_.t[s.begin], part = (own_.t[s.end - 1] - from) / static_cast<double>(parts);
    const double way = s.value > 0 ? 1 : -1, least = clearly * size_of(drive_->value);
    for (std::size_t i = 0; i < parts; ++i) {
      const double begin = from + static_cast<double>(i) * part;
      if (way * mean_of(*drive_, begin, begin + part) < -least) return true;
    }
    return false;
  }

 private:
  const Series& own_;
  const Series* drive_ = nullptr;
};

/// Whether the reference goes on amid a stretch of the voltage that it sets, by what several of its steps are worth. It
/// alone says where a voltage goes.
bool reference_moves(const Run& run, const EqualReadings& s) {
  constexpr std::size_t least = 3;  // rows at the ends, which a driver may be late by
  constexpr double clear = 0.02, several = 3;
  const std::size_t rows = std::max(least, s.length() / 20);  // and one that lags stays within a coarse step for longer
  const Series &e_a = run.at(Signal::e_a), &u_ref = run.at(Signal::u_ref);
  if (s.length() <= 2 * rows) return false;
  const auto begin = std::ranges::lower_bound(u_ref.t, e_a.t[s.begin + rows]) - u_ref.t.begin();
  const auto end = std::ranges::upper_bound(u_ref.t, e_a.t[s.end - 1 - rows]) - u_ref.t.begin();
  if (begin >= end) return false;
  const auto [low, high] = std::minmax_element(u_ref.value.begin() + begin, u_ref.value.begin() + end);
  return *high - *low > std::max(clear, several * step_of(e_a) / size_of(e_a.value)) * size_of(u_ref.value);
}

/// By far more than a signal usually changes from row to row.
double far_change(std::span<const double> x, double step) {
  std::vector<double> changes;
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (x[k] != x[k - 1]) changes.push_back(std::abs(x[k] - x[k - 1]));
  }
  if (changes.empty()) return 8 * step;
  const auto usual = changes.begin() + static_cast<std::ptrdiff_t>(changes.size() * 95 / 100);
  std::ranges::nth_element(changes, usual);
  return std::max(5 * *usual, 8 * step);
}

/// Whether the signal is elsewhere, by a far change, as soon as a stretch ends.
bool jumps_after(std::span<const double> x, const EqualReadings& s, double far) {
  return s.end < x.size() && std::abs(x[s.end] - s.value) > far;
}

/// Whether the motor is at rest by its terminals: no voltage, and no current where it was read.
bool without_power(const Run& run, double from, double to) {
  constexpr double nothing = 0.03;  // of the largest value
  bool told = false;
  for (const Signal signal : {Signal::u_ref, Signal::e_a, Signal::i_a}) {
    if (!run.has(signal) || is_sparse(run, signal)) continue;
    const Series& y = run.at(signal);
    if (std::abs(mean_of(y, from, to)) > nothing * size_of(y.value)) return false;
    told = true;
  }
  return told;
}

/// Whether the shaft turns by several counts of the angle during a stretch, as its speed says. One that stays as it is
/// without power is that of a sensor that is off, or stuck.
/// @param at_rest [rad/s] what the speed reads then
bool turns(const Run& run, double from, double to, double count, double at_rest) {
  constexpr double several = 3, stays = 0.2;
  if (!run.has(Signal::omega) || is_sparse(run, Signal::omega)) return false;
  const Series& omega = run.at(Signal::omega);
  const double speed = std::abs(mean_of(omega, from, to) - at_rest);
  if (speed <= 0.1 * size_of(omega.value) || speed * (to - from) <= several * count) return false;
  const double last_third = to - (to - from) / 3;
  if (!without_power(run, from, last_third)) return true;
  const double until = without_power(run, last_third, to) ? to : last_third;  // power may come back as it ends
  const double third = (until - from) / 3;
  const double slowed = std::abs(mean_of(omega, from, from + third) - mean_of(omega, until - third, until));
  return slowed > stays * speed;
}

/// An angle stands still while the shaft turns: it is somewhere else when it goes on, or the speed says so.
bool angle_held(const Run& run, const Series& series, const EqualReadings& s, double step, double far, double at_rest) {
  if (s.length() < 10) return false;
  return jumps_after(series.value, s, far) || turns(run, series.t[s.begin], series.t[s.end - 1], step, at_rest);
}

/// Longer than a signal stays at one value by chance.
bool is_long(const EqualReadings& s, const Restlessness& usual) {
  return s.length() >= std::max<std::size_t>({20, 20 * usual.length, 3 * usual.rare});
}

/// How restless a signal is where it is off rest.
struct Usual {
  double rest = 0;
  std::optional<double> without;  ///< readings of this value are left out
  Restlessness all, own;
  std::optional<Restlessness> undriven;  ///< told where it is asked; of a voltage it is its own
};

Usual usual_of(const Run& run, Signal signal, double rest, double step, std::optional<double> without = {}) {
  Usual usual{rest, without, restlessness(run.at(signal).value, rest, step, without),
              own_restlessness(run, signal, rest, without), std::nullopt};
  if (signal == Signal::e_a) usual.undriven = usual.own;
  return usual;
}

/// Whether a speed goes, near that of a stretch, by so large a part of itself from reading to reading as few pulses a
/// row make of it. Where their rate goes with the rows there is no such change, and no noise is missing.
bool goes_by_pulses(std::span<const double> x, const EqualReadings& s) {
  constexpr double near = 0.25, few = 64;  // of the speed; pulses a row
  std::vector<double> changes;
  for (std::size_t k = 1; k < x.size(); ++k) {
    const bool is_near = std::max(std::abs(x[k] - s.value), std::abs(x[k - 1] - s.value)) < near * std::abs(s.value);
    if (is_near && x[k] != x[k - 1]) changes.push_back(std::abs(x[k] - x[k - 1]));
  }
  return !changes.empty() && few * median(std::move(changes)) > std::abs(s.value);
}

/// Whether it does without the noise that it has by itself.
bool lacks_noise(const Run& run, Signal signal, const EqualReadings& s, const Drives& drives, Usual& usual) {
  if (!usual.own.noisy || !is_long(s, usual.own)) return false;
  if (signal == Signal::omega && goes_by_pulses(run.at(signal).value, s)) return false;
  if (signal == Signal::e_a) {
    constexpr std::size_t edge = 4;  // rows at the ends, where the reference may change
    // Under a reference that stays a voltage is where it should be, however quiet.
    const Series& series = run.at(signal);
    if (!drives.change(series.t[s.begin + edge], series.t[s.end - 1 - edge])) return false;
  }
  if (!usual.undriven) usual.undriven = undriven_restlessness(run, signal, usual.rest, usual.without);
  return usual.undriven->noisy && is_long(s, *usual.undriven);
}

/// Stretches in which a signal stands still.
struct Frozen {
  std::vector<EqualReadings> sure;      ///< while it should change
  std::vector<EqualReadings> doubtful;  ///< for long: it may be how the sensor is where the load or the driver holds it
};

/// A current that is small may be the offset of a sensor that is silent at rest.
bool may_be_offset(const Run& run, Signal signal, const EqualReadings& s, double step, const Driven& driven) {
  if (signal != Signal::i_a || std::abs(s.value) <= 1.5 * step || !driven.at_all(s)) return true;
  if (run.has(Signal::armature_open)) return true;
  if (!run.has(Signal::omega) || is_sparse(run, Signal::omega)) return false;
  constexpr double turns = 0.05;  // of the highest speed
  const Series &own = run.at(signal), &omega = run.at(Signal::omega);
  return std::abs(mean_of(omega, own.t[s.begin], own.t[s.end - 1])) < turns * size_of(omega.value);
}

/// The stretches of a speed, current, voltage or torque in which it stands still while it should change.
Frozen frozen(const Run& run, Signal signal) {
  const Series& series = run.at(signal);
  const std::span<const double> x = series.value;
  const double step = step_of(series), far = far_change(x, step), rest = std::max(3 * step, 0.05 * size_of(x));
  const Drives drives(run, signal);
  const Driven driven(run, series);
  Usual usual_in_all = usual_of(run, signal, rest, step);
  const auto [low, high] = std::ranges::minmax(x);
  const bool goes_with_drive = signal == Signal::omega || signal == Signal::i_a;  // a load's torque does not
  Frozen found;
  for (const EqualReadings& s : equal_readings(x)) {
    constexpr std::size_t least = 20, most_of_it = 10;  // readings; of so many, it would be its own measure
    if (s.length() < least) continue;
    const bool is_much = s.length() > x.size() / most_of_it, small = std::abs(s.value) <= rest;
    // What is left beside it may be most of all near rest, where noise goes on as well.
    Usual usual_beside;
    if (is_much) usual_beside = usual_of(run, signal, 0, step, s.value);
    Usual& usual = is_much ? usual_beside : usual_in_all;
    if (!is_long(s, usual.all)) continue;
    // Held against the rest alone it may be a setpoint that a controller keeps.
    const bool sure = !small && is_long(s, usual_in_all.all);
    if (small && (!is_much || may_be_offset(run, signal, s, step, driven))) continue;
    // Clipped, if anything: a driver at its limit, read to a step.
    const bool at_an_end = s.value - low < 1.5 * step || high - s.value < 1.5 * step;
    if (!small && at_an_end && !(sure && jumps_after(x, s, far))) continue;
    const bool jump = jumps_after(x, s, far) && !drives.change(series.t[s.end - 1], series.t[s.end]);
    const bool sent_elsewhere = signal == Signal::e_a
                                    ? reference_moves(run, s)
                                    : others_move(run, signal, series.t[s.begin], series.t[s.end - 1]);
    const bool contradicted =
        jump || sent_elsewhere || lacks_noise(run, signal, s, drives, sure ? usual_in_all : usual);
    // A circuit that is opened for a pause has an offset of its own, whatever the driver is asked for.
    const bool pause = signal == Signal::i_a && !is_much;
    if (sure && contradicted) {
      found.sure.push_back(s);
    } else if (contradicted || (goes_with_drive && !pause && driven.back_during(s))) {
      found.doubtful.push_back(s);
    }
  }
  return found;
}

/// The stretches in which an angle does while the shaft turns.
std::vector<EqualReadings> frozen_angles(const Run& run) {
  const Series& theta = run.at(Signal::theta);
  const double step = step_of(theta), far = far_change(theta.value, step), at_rest = speed_read_at_rest(run);
  std::vector<EqualReadings> found;
  for (const EqualReadings& s : equal_readings(theta.value)) {
    if (angle_held(run, theta, s, step, far, at_rest)) found.push_back(s);
  }
  return found;
}

std::string stays_in_words(Signal signal, const EqualReadings& longest, std::size_t times) {
  return name_of(signal) + " stays at " + short_number(longest.value) + " " + std::string(info(signal).unit) + " for " +
         std::to_string(longest.length()) + " readings" +
         (times > 1 ? ", the longest of " + std::to_string(times) + " times" : "");
}

void find_frozen(const Run& run, Signal signal, DataFindings& findings) {
  const Series& series = run.at(signal);
  if (step_of(series) == 0) return;
  const Frozen found = signal == Signal::theta ? Frozen{frozen_angles(run), {}} : frozen(run, signal);
  const bool sure = !found.sure.empty();
  const std::vector<EqualReadings>& all = sure ? found.sure : found.doubtful;
  if (all.empty()) return;
  const EqualReadings longest = *std::ranges::max_element(all, {}, &EqualReadings::length);
  findings.push_back({run.name, signal, Flaw::held, series.t[longest.begin], series.t[longest.end - 1],
                      stays_in_words(signal, longest, all.size()) +
                          (sure ? " while it should change: leave the span out, or empty those cells"
                                : ", which no other reading does: if the sensor or the logger stood still, leave the "
                                  "span out"),
                      sure});
}

/// A signal that is written more often than it is updated changes by whole steps at every k-th row.
void find_repeats(const Run& run, Signal signal, DataFindings& findings) {
  const Series& series = run.at(signal);
  const auto& x = series.value;
  const double step = step_of(series);
  const double same = 0.5 * step, large = 3.5 * step;  // read to a step, whatever arithmetic adds
  std::map<std::size_t, std::size_t> rows_between;     // two large changes: how often
  std::size_t count = 0;
  std::size_t last = 0;
  bool last_large = false;
  for (std::size_t k = 1; k < x.size(); ++k) {
    if (std::abs(x[k] - x[k - 1]) <= same) continue;
    const bool is_large = std::abs(x[k] - x[k - 1]) > large;
    if (is_large && last_large) {
      ++rows_between[k - last];
      ++count;
    }
    last = k;
    last_large = is_large;
  }
  if (count < 30) return;
  const auto most = *std::ranges::max_element(rows_between, {}, [](const auto& p) { return p.second; });
  std::size_t near = most.second;
  for (const std::size_t beside : {most.first - 1, most.first + 1}) {
    if (const auto found = rows_between.find(beside); beside > 1 && found != rows_between.end()) near += found->second;
  }
  if (most.first < 2 || 10 * near < 9 * count) return;
  const double interval = series.t.back() / static_cast<double>(series.t.size() - 1);
  const std::string name = name_of(signal), every = short_number(interval * static_cast<double>(most.first));
  findings.push_back({run.name, signal, Flaw::held, series.t.front(), series.t.back(),
                      name + " is updated every " + every + " s only, " + std::to_string(most.first) +
                          " rows, and each update counts once; where it is a mean over that time, say so (--map, "
                          "window: {" +
                          name + ": " + every + "})",
                      false});
}

}  // namespace

DataFindings held(const Run& run) {
  DataFindings findings;
  for (const Signal signal : measured_signals(run)) {
    find_frozen(run, signal, findings);
    if (signal != Signal::theta) find_repeats(run, signal, findings);
  }
  return findings;
}

}  // namespace emtb
