#include "analysis/record/shaft_angle.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <optional>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/orders.h"
#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

/// The series at the times of the grid, linear in between, constant beyond its ends.
std::vector<double> interpolated(std::span<const double> t, std::span<const double> value,
                                 std::span<const double> grid) {
  std::vector<double> values;
  values.reserve(grid.size());
  std::size_t j = 0;
  for (const double at : grid) {
    while (j + 2 < t.size() && t[j + 1] <= at) ++j;
    const double share = std::clamp((at - t[j]) / (t[j + 1] - t[j]), 0.0, 1.0);
    values.push_back(value[j] + share * (value[j + 1] - value[j]));
  }
  return values;
}

/// Some of the readings, the ripple as it is while the shaft turns forwards.
struct Block {
  TurningStretch ripple;
  double middle = 0;  ///< [readings] from the first
  double turned = 0;  ///< [rad]
};

/// @param size [readings] of each block
std::vector<Block> blocks_of(std::span<const double> angle, std::span<const double> ripple, std::size_t size) {
  std::vector<Block> blocks;
  for (std::size_t from = 0; from + size <= angle.size(); from += size) {
    Block block{{}, static_cast<double>(from) + 0.5 * static_cast<double>(size - 1), 0};
    block.turned = angle[from + size - 1] - angle[from];
    const double sign = block.turned < 0 ? -1 : 1;  // a ripple in proportion to the speed, or to 1/speed, turns over
    for (std::size_t k = from; k < from + size; ++k) {
      block.ripple.angle.push_back(angle[k]);
      block.ripple.value.push_back(sign * ripple[k]);
    }
    blocks.push_back(std::move(block));
  }
  return blocks;
}

/// Pieces of two seconds.
std::vector<TurningStretch> pieces_of(std::span<const double> angle, std::span<const double> ripple, double interval) {
  std::vector<TurningStretch> pieces;
  for (Block& piece : blocks_of(angle, ripple, static_cast<std::size_t>(2 / interval))) {
    pieces.push_back(std::move(piece.ripple));
  }
  return pieces;
}

/// The order of the shaft that stands out most. A whole one where it may be: then the angle keeps its scale.
std::optional<double> order_of(std::span<const TurningStretch> pieces) {
  const std::vector<Order> orders = strong_orders(pieces, 1);
  if (orders.empty()) return std::nullopt;
  const double order = orders.front().per_turn, whole = std::round(order);
  return std::abs(order - whole) < 0.02 ? whole : order;
}

/// A signal that is read about as often as the run has samples.
bool is_fast(const Run& run, Signal signal, std::size_t samples) {
  return run.has(signal) && run.at(signal).window <= 0 && 2 * run.at(signal).t.size() > samples;
}

std::vector<double> integral_of(const Series& omega) {
  std::vector<double> angle(omega.t.size(), 0.0);
  for (std::size_t k = 1; k < angle.size(); ++k) {
    angle[k] = angle[k - 1] + 0.5 * (omega.value[k] + omega.value[k - 1]) * (omega.t[k] - omega.t[k - 1]);
  }
  return angle;
}

double interval_of(const Series& omega) { return mean_interval(omega.t); }

constexpr double clear = 0.3;  // share of what varies within a block: noise alone seldom explains a tenth

/// Far enough for a wave of an order to be told. @param turned [rad]
bool turns_enough(double order, double turned) {
  constexpr double periods = 3;
  return order * std::abs(turned) >= periods * 2 * std::numbers::pi;
}

/// Does a wave stand out in most of the faster half of what turns? What pulls at the shaft shows in its speed while
/// that is slow; then some runs would be tied and others not, and nothing of it holds while the shaft stops.
bool lasts_at_speed(std::span<const std::vector<TurningStretch>> pieces, double order) {
  struct Seen {
    double turned = 0;  // [rad] in two seconds
    bool clear = false;
  };
  std::vector<Seen> all;
  for (const auto& of_run : pieces) {
    for (const TurningStretch& piece : of_run) {
      const double turned = std::abs(piece.angle.back() - piece.angle.front());
      if (!turns_enough(order, turned)) continue;
      all.push_back({turned, wave_of(piece, order).share >= clear});
    }
  }
  std::ranges::sort(all, std::ranges::greater{}, &Seen::turned);
  all.resize((all.size() + 1) / 2);
  return 2 * static_cast<std::size_t>(std::ranges::count(all, true, &Seen::clear)) >= all.size();
}

/// Where the ripple stood in a block.
struct Sighting {
  double middle = 0;  ///< [readings] from the first
  double phase = 0;   ///< [rad] of the order
  double speed = 0;   ///< [rad/s]
};

/// What the angle wanders from block to block [rad], were the reading of the speed behind it by a lag [s]. Such a lag
/// turns the ripple back by atan(order speed lag), while the reading's integral stays behind the shaft by speed lag.
std::vector<double> wander_of(std::span<const Sighting> sightings, double order, double lag) {
  std::vector<double> wander;
  double last = 0;
  for (const Sighting& s : sightings) {
    const double behind = order * s.speed * lag;
    const double phase = s.phase - behind + std::atan(behind);
    const double moved = wander.empty() ? 0 : std::remainder(phase - last, 2 * std::numbers::pi);
    wander.push_back((wander.empty() ? 0 : wander.back()) + moved / order);
    last = phase;
  }
  return wander;
}

/// The lag of the tachogenerator with which the angle wanders least from block to block; 0 where none is much better.
double lag_of(std::span<const Sighting> sightings, double order) {
  constexpr double longest_lag = 0.1, step = 2e-4;  // [s]
  constexpr double much = 0.5;                      // of the squares: with ten blocks chance takes a tenth
  if (sightings.size() < 10) return 0;
  const auto roughness = [&](double lag) {
    const std::vector<double> wander = wander_of(sightings, order, lag);
    double squares = 0;
    for (std::size_t k = 1; k < wander.size(); ++k) squares += std::pow(wander[k] - wander[k - 1], 2);
    return squares;
  };
  double best = 0, least = much * roughness(0);
  for (double lag = step; lag < longest_lag; lag += step) {
    const double rough = roughness(lag);
    if (rough < least) least = rough, best = lag;
  }
  return best;
}

}  // namespace

MeasuredAngle measured_angle(const Run& run, std::span<const double> grid, std::optional<double> order) {
  if (is_fast(run, Signal::theta, grid.size())) {
    return {interpolated(run.at(Signal::theta).t, run.at(Signal::theta).value, grid), false};
  }
  if (!is_fast(run, Signal::omega, grid.size())) return {};
  const Series& omega = run.at(Signal::omega);
  std::vector<double> angle = integral_of(omega);
  const bool tied = order && tie_to_ripple(angle, omega.value, interval_of(omega), order);
  return {interpolated(omega.t, angle, grid), !tied};
}

std::optional<double> ripple_order(std::span<const Run> runs) {
  std::vector<std::vector<TurningStretch>> pieces(runs.size());
  std::vector<std::optional<double>> orders(runs.size());
  parallel_for(runs.size(), [&](std::size_t i) {
    if (!runs[i].has(Signal::omega) || runs[i].has(Signal::theta)) return;
    const Series& omega = runs[i].at(Signal::omega);
    if (omega.window > 0 || omega.t.size() < 2) return;
    const double interval = interval_of(omega);
    pieces[i] = pieces_of(integral_of(omega), without_slow_changes(omega.value, interval), interval);
    orders[i] = order_of(pieces[i]);
  });
  std::optional<double> best;
  double most = 0;
  for (const std::optional<double>& order : orders) {
    if (!order || order == best) continue;
    double explained = 0;
    for (const auto& of_run : pieces) {
      for (const TurningStretch& piece : of_run) explained += wave_of(piece, *order).share;
    }
    if (explained > most) most = explained, best = order;
  }
  return best && lasts_at_speed(pieces, *best) ? best : std::nullopt;
}

bool tie_to_ripple(std::span<double> angle, std::span<const double> omega, double interval,
                   std::optional<double> order) {
  constexpr double longest = 0.5;  // [s] of a block: the wander within is small
  const auto size = static_cast<std::size_t>(longest / interval);
  if (size < 20 || angle.size() < 8 * size) return false;
  const std::vector<double> ripple = without_slow_changes({omega.begin(), omega.end()}, interval);
  if (!order) order = order_of(pieces_of(angle, ripple, interval));
  if (!order) return false;
  std::vector<Sighting> sightings;
  std::size_t turning = 0;
  for (const Block& block : blocks_of(angle, ripple, size)) {
    if (!turns_enough(*order, block.turned)) continue;
    ++turning;
    const Wave wave = wave_of(block.ripple, *order);
    if (wave.share < clear) continue;
    const double seconds = static_cast<double>(size - 1) * interval;
    sightings.push_back({block.middle, std::atan2(wave.cosine, wave.sine), block.turned / seconds});
  }
  if (sightings.size() < 2 || 2 * sightings.size() < turning) return false;
  const double lag = lag_of(sightings, *order);
  std::vector<double> at, readings(angle.size());
  for (const Sighting& s : sightings) at.push_back(s.middle);
  std::iota(readings.begin(), readings.end(), 0.0);
  const std::vector<double> wander = interpolated(at, wander_of(sightings, *order, lag), readings);
  for (std::size_t k = 0; k < angle.size(); ++k) angle[k] += wander[k] + lag * omega[k];
  return true;
}

}  // namespace emtb
