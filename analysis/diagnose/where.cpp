#include "analysis/diagnose/where.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

namespace emtb {
namespace {

ResidualMap map_of(Signal signal, Condition against, const std::vector<ConditionedReading>& points) {
  ResidualMap map{signal, against, {}, {}, {}, {}, {}, 0};
  const Bins bins(points);
  std::vector<ConditionedReading> sums(Bins::count);
  std::vector<double> squares(Bins::count, 0.0), counts(Bins::count, 0.0);
  double total = 0, mean = 0;
  for (const ConditionedReading& p : points) mean += p.residual / static_cast<double>(points.size());
  for (const ConditionedReading& p : points) {
    const std::size_t bin = bins.of(p.condition);
    sums[bin].condition += p.condition;
    sums[bin].residual += p.residual;
    sums[bin].scaled += p.scaled * p.scaled;
    squares[bin] += p.residual * p.residual;
    counts[bin] += 1;
    total += (p.residual - mean) * (p.residual - mean);
  }
  double between = 0;
  for (std::size_t b = 0; b < Bins::count; ++b) {
    if (counts[b] < 3) continue;  // too few to mean anything
    map.bins.push_back(sums[b].condition / counts[b]);
    map.mean.push_back(sums[b].residual / counts[b]);
    map.rmse.push_back(std::sqrt(squares[b] / counts[b]));
    map.ratio.push_back(std::sqrt(sums[b].scaled / counts[b]));
    map.count.push_back(counts[b]);
    between += counts[b] * std::pow(map.mean.back() - mean, 2);
  }
  map.explained = total > 0 ? between / total : 0;
  return map;
}

}  // namespace

std::vector<ResidualMap> residual_maps(std::span<const Record> records, const Model& model) {
  std::vector<ResidualMap> maps;
  for (const auto& [signal, of_signal] : readings_by_condition(records, model)) {
    for (std::size_t c = 0; c < condition_count; ++c) {
      if (of_signal[c].empty()) continue;
      ResidualMap map = map_of(signal, static_cast<Condition>(c), of_signal[c]);
      if (!map.bins.empty()) maps.push_back(std::move(map));
    }
  }
  std::ranges::stable_sort(maps, [](const ResidualMap& a, const ResidualMap& b) {
    return std::pair(a.signal, -a.explained) < std::pair(b.signal, -b.explained);
  });
  return maps;
}

}  // namespace emtb
