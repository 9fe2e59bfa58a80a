#include "analysis/record/smoothed_speed.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <vector>

namespace emtb {
namespace {

/// The last digit that was written: the least by which two readings differ, or so much of the largest.
double last_digit(std::span<const Series> speeds) {
  constexpr double digits = 1e-6;
  std::vector<double> values;
  for (const Series& speed : speeds) values.insert(values.end(), speed.value.begin(), speed.value.end());
  std::ranges::sort(values);
  if (values.empty()) return 0;
  const double least = digits * std::max(std::abs(values.front()), std::abs(values.back()));
  double smallest = values.back() - values.front();
  for (std::size_t k = 1; k < values.size(); ++k) {
    const double gap = values[k] - values[k - 1];
    if (gap > least) smallest = std::min(smallest, gap);
  }
  return std::max(smallest, least);
}

/// Two changes of a speed that follow each other.
struct Changes {
  double before = 0, after = 0;
};

/// Those that are large enough for their ratio to be known, and of which the second is smaller.
std::vector<Changes> changes_of(std::span<const Series> speeds, double digit) {
  constexpr double large = 20;          // last digits
  constexpr std::size_t most = 20'000;  // which tell enough
  std::vector<Changes> all;
  for (const Series& speed : speeds) {
    for (std::size_t k = 2; k < speed.value.size() && all.size() < most; ++k) {
      const Changes c{speed.value[k - 1] - speed.value[k - 2], speed.value[k] - speed.value[k - 1]};
      if (std::abs(c.before) > large * digit && c.before * c.after > 0 && std::abs(c.after) < std::abs(c.before))
        all.push_back(c);
    }
  }
  return all;
}

}  // namespace

std::optional<Smoothing> smoothing_of(std::span<const Series> speeds) {
  constexpr std::size_t candidates = 200, fewest = 8;
  constexpr double least = 0.02, most = 0.995;
  const double digit = last_digit(speeds);
  std::vector<Changes> changes = changes_of(speeds, digit);
  if (changes.size() < fewest) return std::nullopt;
  // the largest tell a share best
  std::ranges::sort(changes, std::greater{}, [](const Changes& c) { return std::abs(c.before); });
  const auto agrees = [&](const Changes& c, double a) { return std::abs(c.after - a * c.before) < (1 + a) * digit; };
  double best = 0;
  std::ptrdiff_t agreeing = 0;
  for (std::size_t k = 0; k < std::min(candidates, changes.size()); ++k) {
    const double a = changes[k].after / changes[k].before;
    if (a < least || a > most) continue;
    const auto n = std::ranges::count_if(changes, [&](const Changes& c) { return agrees(c, a); });
    if (n > agreeing) best = a, agreeing = n;
  }
  if (static_cast<std::size_t>(agreeing) < fewest) return std::nullopt;
  double products = 0, squares = 0;
  for (const Changes& c : changes) {
    if (!agrees(c, best)) continue;
    products += c.before * c.after;
    squares += c.before * c.before;
  }
  const double kept = products / squares;
  return Smoothing{kept, digit * (1 + kept) / (1 - kept)};
}

Series before_smoothing(const Series& smoothed, double kept) {
  Series raw = smoothed;
  const std::span<double> value = raw.value.edit();
  double last = 0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    value[k] = (smoothed.value[k] - kept * last) / (1 - kept);
    last = smoothed.value[k];
  }
  return raw;
}

}  // namespace emtb
