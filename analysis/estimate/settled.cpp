#include "analysis/estimate/settled.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "analysis/estimate/stretches.h"
#include "analysis/numerics/scatter.h"
#include "hal/error.h"
#include "session/text.h"

namespace emtb {
namespace {

constexpr double cell = 0.25;       // [s]
constexpr double slack = 5e-4;      // of the largest value: what may still drift from cell to cell
constexpr double significance = 4;  // sigma

constexpr std::array<Signal, 4> standing{Signal::u_ref, Signal::e_a, Signal::omega, Signal::torque};

/// Mean and standard error of readings that follow each other.
Mean mean_of(std::span<const double> x, double lsb) {
  Mean mean{.readings = x.size()};
  if (x.empty()) return mean;
  const auto n = static_cast<double>(x.size());
  for (const double value : x) mean.value += value / n;
  double squares = 0, products = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    squares += (x[k] - mean.value) * (x[k] - mean.value);
    if (k > 0) products += (x[k] - mean.value) * (x[k - 1] - mean.value);
  }
  const double variance = x.size() > 1 ? squares / (n - 1) : 0;
  const double correlation = squares > 0 ? std::clamp(products / squares, 0.0, 0.99) : 0;
  // Readings that do not scatter over the steps of their instrument hide the same part of a step, all of them.
  const double hidden = variance < lsb * lsb / 4 ? lsb * lsb / 12 : 0;
  mean.std_error = std::sqrt(variance / n * (1 + correlation) / (1 - correlation) + hidden);
  return mean;
}

/// Means of a signal in cells; absent where a cell has no reading.
std::vector<std::optional<Mean>> cells_of(const Series& series, std::size_t count) {
  std::vector<std::optional<Mean>> cells(count);
  std::size_t k = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const double end = static_cast<double>(c + 1) * cell;
    const std::size_t first = k;
    while (k < series.t.size() && series.t[k] < end - 1e-9) ++k;
    if (k == first) continue;
    // The scatter about a line: what moves through a cell is no noise.
    const LocalLine line = local_line(series, static_cast<double>(c) * cell, end - 1e-9);
    std::vector<double> level(series.value.begin() + static_cast<std::ptrdiff_t>(first),
                              series.value.begin() + static_cast<std::ptrdiff_t>(k));
    for (std::size_t j = first; j < k; ++j) level[j - first] -= line.slope * (series.t[j] - end + cell / 2);
    cells[c] = mean_of(level, 0);
  }
  return cells;
}

SettledPoint average(const Run& run, double from, double to, const std::map<Signal, double>& lsb) {
  SettledPoint point{.where = {run.name, from, to}, .mean = {}};
  for (const auto& [signal, series] : run.signals) {
    Mean mean = mean_over(series, from, to);
    if (mean.readings == 0) continue;
    // One reading says nothing of its scatter; two say little.
    if (mean.readings < 3) mean.std_error = std::max(mean.std_error, lsb.at(signal) / std::sqrt(12));
    point.mean.emplace(signal, mean);
  }
  return point;
}

void find(const Run& run, const SettledOptions& options, const std::map<Signal, double>& lsb, Settled& settled) {
  const auto count = static_cast<std::size_t>(std::floor(run.duration() / cell + 1e-9));
  std::vector<char> still(count, 1);  // from the cell before to this one
  if (count > 0) still[0] = 0;
  bool any = false;
  for (const Signal signal : standing) {
    if (!run.has(signal) || is_sparse(run, signal)) continue;
    any = any || signal == Signal::omega || signal == Signal::e_a;
    const Series& series = run.at(signal);
    double largest = 0;
    for (const double x : series.value) largest = std::max(largest, std::abs(x));
    const auto cells = cells_of(series, count);
    // The scatter of a cell that something moves through is no noise: take the median.
    std::vector<double> errors;
    for (const auto& mean : cells) {
      if (mean) errors.push_back(mean->std_error);
    }
    if (errors.empty()) continue;
    const double tolerance = std::max(significance * std::sqrt(2.0) * median(std::move(errors)), slack * largest);
    for (std::size_t c = 1; c < count; ++c) {
      if (!cells[c] || !cells[c - 1] || std::abs(cells[c]->value - cells[c - 1]->value) > tolerance) still[c] = 0;
    }
  }
  if (!any) {
    settled.left_out.push_back({{run.name, 0, run.duration()}, "neither omega nor e_a to see whether anything moves"});
    return;
  }
  for (std::size_t c = 1; c < count;) {
    if (!still[c]) {
      ++c;
      continue;
    }
    const std::size_t first = c - 1;
    while (c < count && still[c]) ++c;
    const double from = static_cast<double>(first + (first > 0 ? 1 : 0)) * cell;
    const double to = static_cast<double>(c - (c < count ? 1 : 0)) * cell;
    if (to - from < options.shortest - 1e-9) {
      if (to > from)
        settled.left_out.push_back(
            {{run.name, from, to}, "settled for less than " + shortest(options.shortest) + " s"});
      continue;
    }
    settled.points.push_back(average(run, from, to, lsb));
  }
}

}  // namespace

Mean mean_over(const Series& series, double from, double to) {
  const auto first = static_cast<std::size_t>(std::ranges::lower_bound(series.t, from - 1e-9) - series.t.begin());
  std::vector<double> inside;
  for (std::size_t k = first; k < series.t.size() && series.t[k] <= to + 1e-9; ++k) {
    if (series.window > 0 && window_start(series, k) < from - 1e-9) continue;
    inside.push_back(series.value[k]);
  }
  return mean_of(inside, series.lsb);
}

Settled settled_points(std::span<const Run> runs, const SettledOptions& options) {
  Settled settled;
  for (const auto& [from, to] : options.chosen) {
    if (std::ranges::none_of(runs,
                             [&](const Run& run) { return from >= 0 && from < to && to <= run.duration() + 1e-6; })) {
      throw SessionError("no run has the stretch " + shortest(from) + ":" + shortest(to) +
                         " s. Give T0:T1 within a run, T0 before T1");
    }
  }
  for (Run run : runs) {
    std::map<Signal, double> lsb;
    for (auto& [signal, series] : run.signals) {
      lsb[signal] = series.lsb = lsb_of(series);
      // Without a window a slow meter's reading is the mean since the one before.
      if (series.window == 0 && is_sparse(run, signal) && series.t.size() > 1) {
        series.window = (series.t.back() - series.t.front()) / static_cast<double>(series.t.size() - 1);
      }
    }
    if (options.chosen.empty()) {
      find(run, options, lsb, settled);
      continue;
    }
    for (const auto& [from, to] : options.chosen) {
      if (from < run.duration()) settled.points.push_back(average(run, from, std::min(to, run.duration()), lsb));
    }
  }
  return settled;
}

}  // namespace emtb
