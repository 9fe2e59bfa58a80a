#include "analysis/record/repeats.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace emtb {

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
