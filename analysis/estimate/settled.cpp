#include "analysis/estimate/settled.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "analysis/numerics/statistics.h"
#include "hal/error.h"
#include "session/gaps.h"
#include "session/text.h"

namespace emtb {
namespace {

// What is settled, in one place. By hand, each set by the three noise levels of
// Settled.FindsThePlateausAndNothingElse and by the paper's staircases (docs/decisions/static-estimates.md).
constexpr double cell = 0.25;       // [s] many readings of a fast signal, short against a stretch
constexpr double slack = 5e-4;      // of the largest value: what may still drift from cell to cell
constexpr double significance = 4;  // standard errors by which two cells may differ: one pair in 16 000 by chance

constexpr std::array<Signal, 4> standing{Signal::u_ref, Signal::e_a, Signal::omega, Signal::torque};

/// Means of a signal in cells; absent where a cell has no reading.
std::vector<std::optional<Mean>> cells_of(const Series& series, std::size_t count) {
  std::vector<std::optional<Mean>> cells(count);
  std::size_t k = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const double end = static_cast<double>(c + 1) * cell;
    const std::size_t first = k;
    while (k < series.t.size() && series.t[k] < end - time_rounding) ++k;
    if (k == first) continue;
    // The scatter about a line: what moves through a cell is no noise.
    const LocalLine line = local_line(series, static_cast<double>(c) * cell, end - time_rounding);
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

/// Does nothing move from the cell before to this one? Nothing where no signal tells.
std::optional<std::vector<char>> still_cells(const Run& run, std::size_t count) {
  std::vector<char> still(count, 1);
  if (count > 0) still[0] = 0;
  bool any = false;
  for (const Signal signal : standing) {
    if (!run.has(signal) || is_sparse(run, signal)) continue;
    any = any || signal == Signal::omega || signal == Signal::e_a;
    const Series& series = run.at(signal);
    const auto cells = cells_of(series, count);
    // The scatter of a cell that something moves through is no noise: take the median.
    std::vector<double> errors;
    for (const auto& mean : cells) {
      if (mean) errors.push_back(mean->std_error);
    }
    if (errors.empty()) continue;
    const double tolerance =
        std::max(significance * std::sqrt(2.0) * median(std::move(errors)), slack * largest_size(series));
    for (std::size_t c = 1; c < count; ++c) {
      if (!cells[c] || !cells[c - 1] || std::abs(cells[c]->value - cells[c - 1]->value) > tolerance) still[c] = 0;
    }
  }
  if (!any) return std::nullopt;
  return still;
}

void find(const Run& run, const SettledOptions& options, const std::map<Signal, double>& lsb, Settled& settled) {
  const auto count = static_cast<std::size_t>(std::floor(run.duration() / cell + 1e-9));  // but for rounding
  const auto found = still_cells(run, count);
  if (!found) {
    settled.left_out.push_back({{run.name, 0, run.duration()}, "neither omega nor e_a to see whether anything moves"});
    return;
  }
  const std::vector<char>& still = *found;
  for (std::size_t c = 1; c < count;) {
    if (!still[c]) {
      ++c;
      continue;
    }
    const std::size_t first = c - 1;
    while (c < count && still[c]) ++c;
    const double from = static_cast<double>(first + (first > 0 ? 1 : 0)) * cell;
    const double to = static_cast<double>(c - (c < count ? 1 : 0)) * cell;
    if (to - from < options.shortest - time_rounding) {
      if (to > from)
        settled.left_out.push_back(
            {{run.name, from, to}, "settled for less than " + shortest(options.shortest) + " s"});
      continue;
    }
    settled.points.push_back(average(run, from, to, lsb));
  }
}

}  // namespace

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
      series.window = averaging_window(run, signal);
    }
    if (options.chosen.empty()) {
      for (const Run& piece : split_at_gaps(run, run.signals.begin()->first)) find(piece, options, lsb, settled);
      continue;
    }
    for (const auto& [from, to] : options.chosen) {
      if (from < run.duration()) settled.points.push_back(average(run, from, std::min(to, run.duration()), lsb));
    }
  }
  return settled;
}

std::vector<const SettledPoint*> points_with(const Settled& settled, std::span<const Signal> signals,
                                             std::vector<LeftOut>& left_out) {
  left_out.insert(left_out.end(), settled.left_out.begin(), settled.left_out.end());
  std::vector<const SettledPoint*> points;
  for (const SettledPoint& p : settled.points) {
    std::vector<std::string> missing;
    for (const Signal signal : signals) {
      if (!p.has(signal)) missing.emplace_back(info(signal).name);
    }
    if (p.has(Signal::armature_open) && p.at(Signal::armature_open) > 0) {
      left_out.push_back({p.where, "the armature is open"});
    } else if (!missing.empty()) {
      left_out.push_back({p.where, "no reading of " + listed(missing) + " lies in it"});
    } else {
      points.push_back(&p);
    }
  }
  return points;
}

}  // namespace emtb
