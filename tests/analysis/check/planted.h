#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <random>
#include <span>

#include "session/session.h"

/// What goes wrong with recordings, done to good ones.
namespace emtb::planted {

inline void scale(Run& run, Signal signal, double factor) {
  for (double& v : run.signals.at(signal).value.edit()) v *= factor;
  run.signals.at(signal).lsb *= std::abs(factor);
}

inline double top(const Run& run, Signal signal) {
  double most = 0;
  for (const double v : run.at(signal).value) most = std::max(most, std::abs(v));
  return most;
}

/// Cuts off what is beyond a share of the largest value.
inline void clip(Run& run, Signal signal, double share) {
  const double most = share * top(run, signal);
  for (double& v : run.signals.at(signal).value.edit()) v = std::clamp(v, -most, most);
}

/// A place at which a signal is well off zero and changes: there a hold contradicts something.
inline std::optional<std::size_t> lively_place(const Run& run, Signal signal, std::size_t length) {
  const auto& x = run.at(signal).value;
  const double most = top(run, signal);
  std::optional<std::size_t> best;
  double change = 0;
  for (std::size_t k = 10; k + 2 * length < x.size(); k += 5) {
    const double here = std::abs(x[k + length] - x[k]);
    if ((signal == Signal::theta || std::abs(x[k]) > 0.3 * most) && here > change) best = k, change = here;
  }
  return change > 0.2 * most || signal == Signal::theta ? best : std::nullopt;
}

inline bool hold(Run& run, Signal signal, std::size_t length) {
  const auto place = lively_place(run, signal, length);
  if (!place) return false;
  const std::span<double> x = run.signals.at(signal).value.edit();
  std::fill_n(x.begin() + static_cast<std::ptrdiff_t>(*place), length, x[*place]);
  return true;
}

inline void spike(Run& run, Signal signal, int count, unsigned seed) {
  std::mt19937 random(seed);
  const std::span<double> x = run.signals.at(signal).value.edit();
  const double most = top(run, signal);
  for (int i = 0; i < count; ++i) {
    const std::size_t k = 10 + random() % (x.size() - 20);
    x[k] += (random() % 2 == 0 ? 0.5 : -0.5) * most * (1 + static_cast<double>(random() % 100) / 100);
  }
}

/// Nothing was read in `from` to `to` [s].
inline void hole(Run& run, double from, double to) {
  for (auto& [signal, s] : run.signals) {
    std::size_t kept = 0;
    for (std::size_t k = 0; k < s.t.size(); ++k) {
      if (s.t[k] > from && s.t[k] < to) continue;
      s.t.edit()[kept] = s.t[k];
      s.value.edit()[kept++] = s.value[k];
    }
    s.t.resize(kept);
    s.value.resize(kept);
  }
}

/// The clock jumps by `seconds` at `from`.
inline void pause(Run& run, double from, double seconds) {
  for (auto& [signal, s] : run.signals) {
    for (double& t : s.t.edit()) t += t > from ? seconds : 0;
  }
}

/// Rows come up to `share` of an interval early or late; those of all signals together.
inline void jitter(Run& run, Signal rows, double share, unsigned seed) {
  const std::vector<double> even = run.at(rows).t;
  const double interval = even.back() / static_cast<double>(even.size() - 1);
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> off(-share, share);
  std::vector<double> uneven = even;
  for (double& t : uneven) t = std::max(0.0, t + off(random) * interval);
  std::ranges::sort(uneven);
  for (std::size_t k = 1; k < uneven.size(); ++k) uneven[k] = std::max(uneven[k], uneven[k - 1] + 1e-9);
  for (auto& [signal, s] : run.signals) {
    for (double& t : s.t.edit()) {
      const auto row = static_cast<std::size_t>(std::ranges::lower_bound(even, t) - even.begin());
      if (row < even.size() && even[row] == t) t = uneven[row];
    }
  }
}

/// A signal that is read late by so many rows.
inline void delay(Run& run, Signal signal, std::size_t rows) {
  const std::span<double> x = run.signals.at(signal).value.edit();
  for (std::size_t k = x.size(); k-- > 0;) x[k] = x[k > rows ? k - rows : 0];
}

/// An encoder's angle beside the speed.
inline void add_angle(Run& run, double counts_a_turn) {
  const Series& omega = run.at(Signal::omega);
  Series theta{.t = omega.t, .value = {}, .window = 0, .lsb = 6.283185307179586 / counts_a_turn, .source = {}};
  double angle = 0;
  for (std::size_t k = 0; k < omega.t.size(); ++k) {
    if (k > 0) angle += 0.5 * (omega.value[k] + omega.value[k - 1]) * (omega.t[k] - omega.t[k - 1]);
    theta.value.push_back(theta.lsb * std::floor(angle / theta.lsb));
  }
  run.signals[Signal::theta] = std::move(theta);
}

}  // namespace emtb::planted
