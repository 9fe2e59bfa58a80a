#include "analysis/check/spikes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <vector>

#include "analysis/check/readings.h"
#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

constexpr std::size_t around = 100;  // readings that say how far a reading usually lies off its neighbours

/// How far each reading lies off the middle of its neighbours.
std::vector<double> off_neighbours(const std::vector<double>& x) {
  std::vector<double> off(x.size(), 0);
  for (std::size_t k = 1; k + 1 < x.size(); ++k) off[k] = x[k] - 0.5 * (x[k - 1] + x[k + 1]);
  return off;
}

/// How far a signal lies off its neighbours, reading by reading, and how far it usually does.
struct Off {
  Signal signal;
  std::vector<double> t, sizes;
  double usual = 0;

  /// Does a reading lie further off than any near by? Not where these lie as far off: a signal that is rough there.
  bool stands_out(std::size_t k) const {
    constexpr double clearly = 3;  // times what nine in ten near by do
    const std::size_t from = k > around / 2 ? k - around / 2 : 0, to = std::min(from + around, sizes.size());
    std::vector<double> near(sizes.begin() + static_cast<std::ptrdiff_t>(from),
                             sizes.begin() + static_cast<std::ptrdiff_t>(to));
    std::ranges::sort(near);
    return sizes[k] >= clearly * near[near.size() * 9 / 10];
  }

  bool stands_out_at(double time) const {
    const auto k = static_cast<std::size_t>(std::ranges::lower_bound(t, time) - t.begin());
    return k < t.size() && t[k] == time && sizes[k] > 0 && (stands_out(k) || sizes[k] >= far * usual);
  }

  static constexpr double far = 10;  // times the usual
};

std::vector<Off> all_off(const Run& run) {
  std::vector<Off> all;
  for (const Signal signal : measured_signals(run)) {
    const Series& series = run.at(signal);
    if (series.value.size() < around) continue;
    Off off{signal, series.t, off_neighbours(series.value)};
    for (double& size : off.sizes) size = std::abs(size);
    off.usual = robust_sigma(off.sizes);
    all.push_back(std::move(off));
  }
  return all;
}

/// How far the neighbours of a reading go by themselves.
double neighbours_go(std::span<const double> x, std::size_t k) {
  return std::max({std::abs(x[k + 1] - x[k - 1]), std::abs(x[k - 1] - x[k - 2]), std::abs(x[k + 2] - x[k + 1])});
}

constexpr double alone = 0.3;  // of how far a reading lies off: its neighbours go less

/// Does it begin to move in row k, after it has stood for long, and go on?
bool begins_to_move(std::span<const double> x, std::size_t k) {
  constexpr std::size_t stand = 10;  // rows
  if (k < stand || k + 2 >= x.size()) return false;
  const double rise = x[k] - x[k - 1];
  const auto still = x.subspan(k - stand, stand);
  return std::ranges::all_of(still, [&](double value) { return value == still.front(); }) &&
         rise * (x[k + 1] - x[k]) > 0 && rise * (x[k + 2] - x[k + 1]) > 0;
}

/// [s] When the reference leaves its neighbours for one row, as a controller's does at the count of an encoder, or
/// begins a ramp, under which a current jumps before the shaft turns: what it drives follows, up to a delay later.
std::vector<double> kicks_of_the_reference(const Run& run) {
  std::vector<double> times;
  if (!run.has(Signal::u_ref)) return times;
  const Series& series = run.at(Signal::u_ref);
  const std::vector<double>& x = series.value;
  const std::vector<double> off = off_neighbours(x);
  for (std::size_t k = 2; k + 2 < x.size(); ++k) {
    const bool is_alone = off[k] != 0 && neighbours_go(x, k) < alone * std::abs(off[k]);
    if (is_alone || begins_to_move(x, k)) times.push_back(series.t[k]);
  }
  return times;
}

/// How fast the shaft turns, reading by reading: its speed, or how far its angle goes in a few rows.
struct Turning {
  std::span<const double> t;
  std::vector<double> speed;
  double highest = 0;

  explicit Turning(const Run& run) {
    constexpr std::size_t rows = 3;  // to either side
    if (run.has(Signal::omega)) {
      t = run.at(Signal::omega).t;
      speed = run.at(Signal::omega).value;
    } else if (run.has(Signal::theta) && run.at(Signal::theta).t.size() > 2 * rows) {
      const Series& theta = run.at(Signal::theta);
      t = theta.t;
      for (std::size_t k = 0; k < t.size(); ++k) {
        const std::size_t from = k > rows ? k - rows : 0, to = std::min(k + rows, t.size() - 1);
        speed.push_back((theta.value[to] - theta.value[from]) / (t[to] - t[from]));
      }
    }
    highest = size_of(speed);
  }

  /// Does the shaft stand at a time? A dry brake holds it with any torque, and lets go and catches again within a
  /// reading.
  bool stands(double time) const {
    constexpr double slow = 0.05;  // of the highest speed
    const auto k = static_cast<std::size_t>(std::ranges::lower_bound(t, time) - t.begin());
    return k < speed.size() && std::abs(speed[k]) < slow * highest;
  }
};

}  // namespace

DataFindings spikes(const Run& run) {
  DataFindings findings;
  constexpr double longest = 0.1;  // [s] of a driver's delay
  const std::vector<Off> all = all_off(run);
  const std::vector<double> sent = kicks_of_the_reference(run);
  const auto was_sent = [&](double time) {
    const auto next = std::ranges::upper_bound(sent, time);
    return next != sent.begin() && time - *(next - 1) < longest;
  };
  std::optional<Turning> shaft;
  if (run.has(Signal::torque)) shaft.emplace(run);
  for (const Off& own : all) {
    const auto& [signal, t, sizes, usual] = own;
    const Series& series = run.at(signal);
    const auto& x = series.value;
    // A glitch is one instrument's. What two of them see at one time has happened.
    const auto another_sees_it = [&](double time) {
      return std::ranges::any_of(all, [&](const Off& o) { return &o != &own && o.stands_out_at(time); });
    };
    const double step = signal == Signal::omega ? step_of_speed(series) : step_of(series);
    const Drives drives(run, signal);
    std::vector<std::size_t> found;
    double energy = 0;
    for (std::size_t k = 2; k + 2 < x.size(); ++k) {
      const double least = std::max(Off::far * usual, 4 * step);
      if (sizes[k] < least || sizes[k] == 0) continue;  // a signal that stands has neither noise nor steps
      if (neighbours_go(x, k) > alone * sizes[k] || was_sent(series.t[k])) continue;
      if (!own.stands_out(k) || drives.change(series.t[k], series.t[k])) continue;
      if (another_sees_it(series.t[k]) || (signal == Signal::torque && shaft->stands(series.t[k]))) continue;
      found.push_back(k);
      energy += sizes[k] * sizes[k];
    }
    if (found.empty()) continue;
    const std::size_t worst = *std::ranges::max_element(found, {}, [&](std::size_t k) { return sizes[k]; });
    const double noise = std::max(usual / std::sqrt(1.5), step / std::sqrt(12.0));
    findings.push_back({run.name, signal, Flaw::spikes, series.t[found.front()], series.t[found.back()],
                        std::to_string(found.size()) + (found.size() == 1 ? " reading stands" : " readings stand") +
                            " alone, " + short_number(x[worst]) + " " + std::string(info(signal).unit) + " at " +
                            short_number(series.t[worst]) + " s the furthest, " + short_number(sizes[worst] / noise) +
                            " times the noise off both neighbours: empty those "
                            "cells",
                        energy > 0.25 * noise * noise * static_cast<double>(x.size())});
  }
  return findings;
}

}  // namespace emtb
