#include "analysis/check/spikes.h"

#include <algorithm>
#include <cmath>

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

}  // namespace

DataFindings spikes(const Run& run) {
  DataFindings findings;
  for (const Signal signal : measured_signals(run)) {
    const Series& series = run.at(signal);
    const auto& x = series.value;
    if (x.size() < around) continue;
    const std::vector<double> off = off_neighbours(x);
    std::vector<double> sizes;
    for (const double o : off) sizes.push_back(std::abs(o));
    const double usual = robust_sigma(sizes);
    const double step = step_of(series);
    const Drives drives(run, signal);
    std::vector<std::size_t> found;
    double energy = 0;
    for (std::size_t k = 2; k + 2 < x.size(); ++k) {
      const double least = std::max(10 * usual, 4 * step);
      if (sizes[k] < least || sizes[k] == 0) continue;  // a signal that stands has neither noise nor steps
      const double neighbours =
          std::max({std::abs(x[k + 1] - x[k - 1]), std::abs(x[k - 1] - x[k - 2]), std::abs(x[k + 2] - x[k + 1])});
      if (neighbours > 0.3 * sizes[k]) continue;
      const std::size_t from = k > around / 2 ? k - around / 2 : 0, to = std::min(from + around, x.size());
      std::vector<double> near(sizes.begin() + static_cast<std::ptrdiff_t>(from),
                               sizes.begin() + static_cast<std::ptrdiff_t>(to));
      std::ranges::sort(near);
      // Not where readings near by lie as far off: a signal that is rough there.
      if (sizes[k] < 3 * near[near.size() * 9 / 10] || drives.change(series.t[k], series.t[k])) continue;
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
