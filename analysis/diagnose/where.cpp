#include "analysis/diagnose/where.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "model/catalogue.h"
#include "model/simulation.h"

namespace emtb {
namespace {

constexpr std::size_t bin_count = 12;

/// What residuals are held against, and its name in the contract.
enum Condition : std::size_t { acceleration, current, speed, direction, elapsed, reference };
constexpr std::array<std::string_view, 6> conditions{"acceleration", "i_a", "omega", "sign(omega)", "t", "u_ref"};

/// One reading: the condition it was taken in, the residual in SI and in units of sigma.
struct Point {
  double condition, residual, scaled;
};

double mean_over(const std::vector<double>& x, std::size_t first, std::size_t last) {
  double sum = 0;
  for (std::size_t k = first; k <= last; ++k) sum += x[k];
  return sum / static_cast<double>(last - first + 1);
}

ResidualMap map_of(Signal signal, const std::string& against, const std::vector<Point>& points) {
  ResidualMap map{signal, against, {}, {}, {}, {}, {}, 0};
  const auto [low, high] = std::ranges::minmax(points, {}, &Point::condition);
  const double from = low.condition, width = (high.condition - from) / bin_count;
  std::vector<Point> sums(bin_count, Point{0, 0, 0});
  std::vector<double> squares(bin_count, 0.0), counts(bin_count, 0.0);
  double total = 0, mean = 0;
  for (const Point& p : points) mean += p.residual / static_cast<double>(points.size());
  for (const Point& p : points) {
    const std::size_t bin =
        width > 0 ? std::min(bin_count - 1, static_cast<std::size_t>((p.condition - from) / width)) : 0;
    sums[bin].condition += p.condition;
    sums[bin].residual += p.residual;
    sums[bin].scaled += p.scaled * p.scaled;
    squares[bin] += p.residual * p.residual;
    counts[bin] += 1;
    total += (p.residual - mean) * (p.residual - mean);
  }
  double between = 0;
  for (std::size_t b = 0; b < bin_count; ++b) {
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
  std::map<Signal, std::array<std::vector<Point>, conditions.size()>> points;
  const std::vector<double> values = model.values();
  // The conditions are those of the machine, not what its instruments make of them.
  Model machine = model;
  for (const IncludedEffect& e : model.effects) {
    if (effect_catalogue()[e.effect].stage == Stage::sensors) machine.exclude(e.effect);
  }
  const std::vector<double> machine_values = machine.values();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    const Excitation& x = record.excitation;
    Trajectory<double> y;
    simulate<double>(record.structure(machine), machine_values, x, y);
    const std::vector<Residuals> rs = residuals(records, i, record.structure(model), values, {});
    for (std::size_t s = 0; s < rs.size(); ++s) {
      const Observation& o = record.observations[s];
      auto& of_signal = points[o.signal];
      for (std::size_t j = 0; j < o.size(); ++j) {
        const std::size_t a = o.first[j], k = o.last[j];
        const auto over = [&](const std::vector<double>& signal) { return mean_over(signal, a, k); };
        const double scaled = rs[s].value[static_cast<Eigen::Index>(j)];
        const auto put = [&](Condition against, double condition) {
          of_signal[against].push_back({condition, scaled * o.sigma[j], scaled});
        };
        const double omega = over(y.omega);
        put(elapsed, x.t[k]);
        put(speed, omega);
        put(direction, omega > 0 ? 1 : omega < 0 ? -1 : 0);
        put(current, over(y.i_a));
        if (!x.u_ref.empty()) put(reference, x.u_ref[k]);
        const std::size_t before = a == k && a > 0 ? a - 1 : a;
        if (k > before) put(acceleration, (y.omega[k] - y.omega[before]) / (x.t[k] - x.t[before]));
      }
    }
  }
  std::vector<ResidualMap> maps;
  for (const auto& [signal, of_signal] : points) {
    for (std::size_t c = 0; c < conditions.size(); ++c) {
      if (of_signal[c].empty()) continue;
      ResidualMap map = map_of(signal, std::string(conditions[c]), of_signal[c]);
      if (!map.bins.empty()) maps.push_back(std::move(map));
    }
  }
  std::ranges::stable_sort(maps, [](const ResidualMap& a, const ResidualMap& b) {
    return std::pair(a.signal, -a.explained) < std::pair(b.signal, -b.explained);
  });
  return maps;
}

}  // namespace emtb
