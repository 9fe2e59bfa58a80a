#include "analysis/record/repeats.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

namespace emtb {

namespace {

/// The smallest step of a signal, but for a few by chance; 0: it never changes.
double step_of(std::span<const double> value) {
  std::vector<double> steps;
  for (std::size_t k = 1; k < value.size(); ++k) {
    if (value[k] != value[k - 1]) steps.push_back(std::abs(value[k] - value[k - 1]));
  }
  if (steps.empty()) return 0;
  const auto small = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 20);
  std::ranges::nth_element(steps, small);
  return *small;
}

/// The rows amid a steady motion, in which a signal goes on by several of its steps each.
std::vector<std::size_t> moving_rows(std::span<const double> value) {
  constexpr std::size_t part = 4;  // rows; three of them in a row go on alike, which no single edge does
  constexpr double several = 4;
  const double least = several * step_of(value) * static_cast<double>(part);
  std::vector<std::size_t> rows;
  for (std::size_t end = 3 * part; end < value.size() && least > 0; ++end) {
    const auto gone = [&](std::size_t parts) { return value[end - parts * part] - value[end - (parts + 1) * part]; };
    const double on = std::copysign(1.0, gone(1));
    if (on * gone(0) > least && on * gone(1) > least && on * gone(2) > least) rows.push_back(end - 3 * part / 2);
  }
  return rows;
}

/// The rows between changes while a signal moves, in the mean, where these are clearly more than one.
std::optional<double> uneven_rows_an_update(std::span<const double> value) {
  constexpr std::size_t enough = 50;
  constexpr double often = 1.3;  // rows between changes
  const std::vector<std::size_t> moving = moving_rows(value);
  if (moving.size() < enough) return std::nullopt;
  const auto changes = std::ranges::count_if(moving, [&](std::size_t k) { return value[k] != value[k - 1]; });
  const double rows = static_cast<double>(moving.size()) / static_cast<double>(std::max<std::ptrdiff_t>(1, changes));
  return rows > often ? std::optional(rows) : std::nullopt;
}

/// @param rows between changes, in the mean
Series uneven_updates_of(const Series& series, double rows) {
  constexpr double usual = 2;  // times the rows between changes: nobody knows when what stays was read
  const std::vector<double>& value = series.value;
  const double longest = usual * rows;
  Series updates = series;
  updates.t.clear();
  updates.value.clear();
  std::size_t last = 0;
  for (std::size_t k = 0; k < value.size(); ++k) {
    if (k > 0 && value[k] == value[k - 1] && static_cast<double>(k - last) < longest) continue;
    updates.t.push_back(series.t[k]);
    updates.value.push_back(value[k]);
    last = k;
  }
  return updates;
}

}  // namespace

std::size_t rows_an_update(std::span<const double> value, std::size_t* first) {
  constexpr std::size_t most_rows = 20;
  constexpr double nearly_all = 0.97;  // of the changes: a clock may slip
  constexpr double by_chance = 1e-6;   // that changes at any row are all at every so many
  std::vector<std::size_t> changes;
  for (std::size_t k = 1; k < value.size(); ++k) {
    if (value[k] != value[k - 1]) changes.push_back(k);
  }
  if (changes.empty()) return 1;
  for (std::size_t rows = std::min(most_rows, value.size() / changes.size()); rows > 1; --rows) {
    if (std::pow(static_cast<double>(rows), 1 - static_cast<double>(changes.size())) > by_chance) continue;
    std::vector<std::size_t> at_phase(rows, 0);
    for (const std::size_t k : changes) ++at_phase[k % rows];
    const auto most = std::ranges::max_element(at_phase);
    if (static_cast<double>(*most) < nearly_all * static_cast<double>(changes.size())) continue;
    if (first != nullptr) *first = static_cast<std::size_t>(most - at_phase.begin());
    return rows;
  }
  return 1;
}

bool repeats_unevenly(std::span<const double> value) { return uneven_rows_an_update(value).has_value(); }

bool repeats(std::span<const double> value) { return rows_an_update(value) > 1 || repeats_unevenly(value); }

Series updates_of(const Series& series) {
  std::size_t first = 0;
  const std::size_t rows = rows_an_update(series.value, &first);
  if (rows == 1) return series;
  Series updates = series;
  updates.t.clear();
  updates.value.clear();
  for (std::size_t k = first; k < series.t.size(); k += rows) {
    updates.t.push_back(series.t[k]);
    updates.value.push_back(series.value[k]);
  }
  return updates;
}

Series readings_of(const Series& series) {
  Series updates = updates_of(series);
  if (updates.t.size() < series.t.size()) return updates;
  const std::optional<double> rows = uneven_rows_an_update(series.value);
  return rows ? uneven_updates_of(series, *rows) : updates;
}

Series straight_between_updates(const Series& series) {
  std::size_t first = 0;
  const std::size_t rows = rows_an_update(series.value, &first);
  if (rows == 1) return series;
  Series straight = series;
  const std::span<double> value = straight.value.edit();
  for (std::size_t k = first; k + rows < series.t.size(); k += rows) {
    const double from = series.value[k], to = series.value[k + rows], interval = series.t[k + rows] - series.t[k];
    for (std::size_t i = k + 1; i < k + rows; ++i)
      value[i] = std::lerp(from, to, (series.t[i] - series.t[k]) / interval);
  }
  return straight;
}

}  // namespace emtb
