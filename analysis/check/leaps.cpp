#include "analysis/check/leaps.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "analysis/check/readings.h"
#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

constexpr std::size_t around = 50;  // readings before and after that say how far the speed goes
constexpr std::size_t longest = 3;  // readings: what lasts longer has been, as far as one signal can tell

/// How much the speed changes from each row to the next.
std::vector<double> changes_of(std::span<const double> x) {
  std::vector<double> sizes;
  for (std::size_t k = 0; k + 1 < x.size(); ++k) sizes.push_back(std::abs(x[k + 1] - x[k]));
  return sizes;
}

struct Group {
  std::size_t from, to;
  double beyond;  ///< how far it stands beyond all others
};

/// The readings that end with row `to` and stand beyond those before and after by a third of how far these go.
std::optional<Group> beyond_others(std::span<const double> x, std::size_t to) {
  constexpr double far = 0.3;
  const double sign = x[to] > x[to + 1] ? 1 : -1;
  const std::span<const double> after = x.subspan(to + 1, std::min(around, x.size() - to - 1));
  for (std::size_t length = 1; length <= longest && length <= to; ++length) {
    const std::size_t from = to + 1 - length;
    const std::size_t begin = from > around ? from - around : 0;
    const std::span<const double> before = x.subspan(begin, from - begin);
    const auto [low_after, high_after] = std::ranges::minmax(after);
    const auto [low_before, high_before] = std::ranges::minmax(before);
    const double low = std::min(low_after, low_before), high = std::max(high_after, high_before);
    const auto beyond = [&](double v) { return sign > 0 ? v - high : low - v; };
    const double least = beyond(std::ranges::min(x.subspan(from, length), {}, beyond));
    if (least > far * (high - low)) return Group{from, to, least};
  }
  return {};
}

/// The largest changes of a speed that is left to itself.
class Undriven {
 public:
  Undriven(const Series& speed, std::span<const double> sizes, const Drives& drives) {
    for (std::size_t k = 0; k < sizes.size(); ++k) {
      if ((largest_.size() == kept && sizes[k] <= sizes[largest_.back()]) || drives.change(speed.t[k], speed.t[k + 1]))
        continue;
      largest_.insert(
          std::ranges::upper_bound(largest_, sizes[k], std::greater{}, [&](std::size_t i) { return sizes[i]; }), k);
      if (largest_.size() > kept) largest_.pop_back();
    }
    sizes_ = sizes;
  }

  /// From row to row outside of a group.
  double largest_outside(const Group& group) const {
    for (const std::size_t k : largest_) {
      if (k + 1 < group.from || k > group.to) return sizes_[k];
    }
    return 0;
  }

 private:
  static constexpr std::size_t kept = longest + 2;  // as many may lie at a group, one more does not
  std::vector<std::size_t> largest_;
  std::span<const double> sizes_;
};

}  // namespace

DataFindings leaps(const Run& run) {
  constexpr double faster = 5;  // than anywhere else
  constexpr double clear = 10;  // times what a reading usually changes by
  if (!run.has(Signal::omega) || !(run.has(Signal::u_ref) || run.has(Signal::e_a))) return {};
  const Series& speed = run.at(Signal::omega);
  const std::vector<double>& x = speed.value;
  if (x.size() < 2 * around) return {};
  const std::vector<double> sizes = changes_of(x);
  const Undriven undriven(speed, sizes, Drives(run, Signal::omega));
  const Drives exact(run, Signal::omega, Drives::Change::large, 0);
  const double usual = robust_sigma(sizes), step = step_of_speed(speed);
  std::vector<Group> found;
  for (std::size_t k = 1; k + longest < x.size(); ++k) {
    if (sizes[k] < std::max(clear * usual, 4 * step) || exact.change(speed.t[k], speed.t[k + 1])) continue;
    const std::optional<Group> group = beyond_others(x, k);
    if (!group || sizes[k] < faster * undriven.largest_outside(*group)) continue;
    found.push_back(*group);
  }
  if (found.empty()) return {};
  std::size_t count = 0;
  double energy = 0;
  for (const Group& g : found) {
    count += g.to - g.from + 1;
    energy += g.beyond * g.beyond * static_cast<double>(g.to - g.from + 1);
  }
  const Group& worst = *std::ranges::max_element(found, {}, &Group::beyond);
  const double noise = std::max(usual / std::sqrt(2.0), step / std::sqrt(12.0));
  return {{run.name, Signal::omega, Flaw::spikes, speed.t[found.front().from], speed.t[found.back().to],
           std::to_string(count) + (count == 1 ? " reading leaps, " : " readings leap, ") + short_number(x[worst.to]) +
               " rad/s at " + short_number(speed.t[worst.to]) +
               " s the furthest, and the next row is back, which no shaft can while its voltage stays: empty those "
               "cells",
           energy > 0.25 * noise * noise * static_cast<double>(x.size())}};
}

}  // namespace emtb
