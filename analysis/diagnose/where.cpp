#include "analysis/diagnose/where.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <utility>

#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

/// The standard error of each bin's mean: readings of one piece of a run hang together, those of different ones do not.
std::vector<double> standard_errors(const std::vector<ConditionedReading>& points, const Bins& bins,
                                    std::span<const double> means) {
  struct Sums {
    double squares = 0, count = 0;
    std::map<std::size_t, double> off;  // of each piece: the sum of what its readings are off the mean
  };
  std::vector<Sums> sums(Bins::count);
  for (const ConditionedReading& p : points) {
    const std::size_t bin = bins.of(p.condition);
    const double off = p.residual - means[bin];
    sums[bin].squares += off * off;
    sums[bin].off[p.piece] += off;
    sums[bin].count += 1;
  }
  std::vector<double> errors;
  for (const Sums& s : sums) {
    const double pieces = static_cast<double>(s.off.size());
    double between = 0;
    for (const auto& [piece, off] : s.off) between += off * off;
    const bool tell = pieces >= 3;  // how they hang together
    errors.push_back(std::sqrt(tell ? std::max(s.squares, between * pieces / (pieces - 1)) : s.squares) /
                     std::max(1.0, s.count));
  }
  return errors;
}

ResidualMap map_of(Signal signal, Condition against, const std::vector<ConditionedReading>& points) {
  ResidualMap map{.signal = signal, .against = against};
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
  std::vector<double> means;
  for (std::size_t b = 0; b < Bins::count; ++b) means.push_back(sums[b].residual / std::max(1.0, counts[b]));
  const std::vector<double> errors = standard_errors(points, bins, means);
  double between = 0;
  for (std::size_t b = 0; b < Bins::count; ++b) {
    if (counts[b] < 3) continue;  // too few to mean anything
    map.bins.push_back(sums[b].condition / counts[b]);
    map.mean.push_back(means[b]);
    map.rmse.push_back(std::sqrt(squares[b] / counts[b]));
    map.ratio.push_back(std::sqrt(sums[b].scaled / counts[b]));
    map.count.push_back(counts[b]);
    map.std_error.push_back(errors[b]);
    between += counts[b] * std::pow(map.mean.back() - mean, 2);
  }
  map.explained = total > 0 ? between / total : 0;
  return map;
}

}  // namespace

std::vector<ResidualMap> residual_maps(std::span<const Record> records, const Model& model) {
  return residual_maps(RecordRefs(records.begin(), records.end()), model);
}

std::vector<ResidualMap> residual_maps(const RecordRefs& records, const Model& model) {
  constexpr double pieces = 64;  // of all runs: between the 128 and the 16 that the parameters' errors are asked of
  double duration = 0;
  for (const Record& record : records) duration += record.excitation.t.back() - record.excitation.t.front();
  std::vector<ResidualMap> maps;
  const auto alike = [&](Signal) { return duration / pieces; };
  visit_readings_by_condition(records, model, alike, [&](Signal signal, const ReadingsByCondition& all) {
    std::array<ResidualMap, condition_count> of_each;
    parallel_for(condition_count, [&](std::size_t c) {
      if (!all[c].empty()) of_each[c] = map_of(signal, static_cast<Condition>(c), all[c]);
    });
    for (ResidualMap& map : of_each) {
      if (!map.bins.empty()) maps.push_back(std::move(map));
    }
  });
  std::ranges::stable_sort(maps, [](const ResidualMap& a, const ResidualMap& b) {
    return std::pair(a.signal, -a.explained) < std::pair(b.signal, -b.explained);
  });
  return maps;
}

}  // namespace emtb
