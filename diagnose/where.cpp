#include "diagnose/where.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "model/catalogue.h"
#include "model/simulation.h"

namespace emtb {
namespace {

constexpr std::size_t bin_count = 12;

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

std::vector<ResidualMap> residual_maps(std::span<const PreparedRun> records, const Model& model) {
  std::map<std::pair<Signal, std::string>, std::vector<Point>> points;
  const std::vector<double> values = model.values();
  // The conditions are those of the machine, not what its instruments make of them.
  Model machine = model;
  for (const IncludedEffect& e : model.effects) {
    if (effect_catalogue()[e.effect].stage == Stage::sensors) machine.exclude(e.effect);
  }
  const std::vector<double> machine_values = machine.values();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const PreparedRun& record = records[i];
    const Excitation& x = record.excitation;
    Trajectory<double> y;
    simulate<double>(record.structure(machine), machine_values, x, y);
    const std::vector<Residuals> rs = residuals(records, i, record.structure(model), values, {});
    for (std::size_t s = 0; s < rs.size(); ++s) {
      const Observation& o = record.observations[s];
      for (std::size_t j = 0; j < o.size(); ++j) {
        const std::size_t a = o.first[j], k = o.last[j];
        const auto over = [&](const std::vector<double>& signal) { return mean_over(signal, a, k); };
        const double scaled = rs[s].value[static_cast<Eigen::Index>(j)];
        const auto put = [&](const char* against, double condition) {
          points[{o.signal, against}].push_back({condition, scaled * o.sigma[j], scaled});
        };
        const double omega = over(y.omega);
        put("t", x.t[k]);
        put("omega", omega);
        put("sign(omega)", omega > 0 ? 1 : omega < 0 ? -1 : 0);
        put("i_a", over(y.i_a));
        if (!x.u_ref.empty()) put("u_ref", x.u_ref[k]);
        const std::size_t before = a == k && a > 0 ? a - 1 : a;
        if (k > before) put("acceleration", (y.omega[k] - y.omega[before]) / (x.t[k] - x.t[before]));
      }
    }
  }
  std::vector<ResidualMap> maps;
  for (const auto& [key, list] : points) {
    ResidualMap map = map_of(key.first, key.second, list);
    if (!map.bins.empty()) maps.push_back(std::move(map));
  }
  std::ranges::stable_sort(maps, [](const ResidualMap& a, const ResidualMap& b) {
    return std::pair(a.signal, -a.explained) < std::pair(b.signal, -b.explained);
  });
  return maps;
}

}  // namespace emtb
