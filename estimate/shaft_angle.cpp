#include "estimate/shaft_angle.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <optional>

#include "estimate/orders.h"

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

/// The order of the shaft that stands out most. A whole one where it may be: then the angle keeps its scale.
std::optional<double> order_of(std::span<const double> angle, std::span<const double> ripple, double interval) {
  std::vector<TurningStretch> pieces;
  for (Block& piece : blocks_of(angle, ripple, static_cast<std::size_t>(2 / interval))) {
    pieces.push_back(std::move(piece.ripple));
  }
  const std::vector<Order> orders = strong_orders(pieces, 1);
  if (orders.empty()) return std::nullopt;
  const double order = orders.front().per_turn, whole = std::round(order);
  return std::abs(order - whole) < 0.02 ? whole : order;
}

}  // namespace

std::vector<double> measured_angle(const Run& run, std::span<const double> grid) {
  const auto fast = [&](Signal signal) {
    return run.has(signal) && run.at(signal).window <= 0 && 2 * run.at(signal).t.size() > grid.size();
  };
  if (fast(Signal::theta)) return interpolated(run.at(Signal::theta).t, run.at(Signal::theta).value, grid);
  if (!fast(Signal::omega)) return {};
  const Series& omega = run.at(Signal::omega);
  std::vector<double> angle(omega.t.size(), 0.0);
  for (std::size_t k = 1; k < angle.size(); ++k) {
    angle[k] = angle[k - 1] + 0.5 * (omega.value[k] + omega.value[k - 1]) * (omega.t[k] - omega.t[k - 1]);
  }
  tie_to_ripple(angle, omega.value, (omega.t.back() - omega.t.front()) / static_cast<double>(omega.t.size() - 1));
  return interpolated(omega.t, angle, grid);
}

void tie_to_ripple(std::span<double> angle, std::span<const double> omega, double interval) {
  constexpr double clear = 0.3;    // share of what varies within a block: noise alone seldom explains a tenth
  constexpr double periods = 3;    // at least, in a block
  constexpr double longest = 0.5;  // [s] of a block: the wander within is small
  const auto size = static_cast<std::size_t>(longest / interval);
  if (size < 20 || angle.size() < 8 * size) return;
  const std::vector<double> ripple = without_slow_changes({omega.begin(), omega.end()}, interval);
  const std::optional<double> order = order_of(angle, ripple, interval);
  if (!order) return;
  std::vector<double> at, wander;  // [readings], [rad]
  std::size_t turning = 0;
  double last = 0;
  for (const Block& block : blocks_of(angle, ripple, size)) {
    if (*order * std::abs(block.turned) < periods * 2 * std::numbers::pi) continue;
    ++turning;
    const Wave wave = wave_of(block.ripple, *order);
    if (wave.share < clear) continue;
    const double phase = std::atan2(wave.cosine, wave.sine);
    const double before = wander.empty() ? 0 : wander.back();
    const double moved = wander.empty() ? 0 : std::remainder(phase - last, 2 * std::numbers::pi);
    last = phase;
    at.push_back(block.middle);
    wander.push_back(before + moved / *order);
  }
  if (at.size() < 2 || 2 * at.size() < turning) return;
  std::vector<double> readings(angle.size());
  std::iota(readings.begin(), readings.end(), 0.0);
  const std::vector<double> all = interpolated(at, wander, readings);
  std::ranges::transform(angle, all, angle.begin(), std::plus{});
}

}  // namespace emtb
