#include "analysis/diagnose/where.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <span>
#include <string_view>
#include <utility>

#include "model/catalogue.h"
#include "model/simulation.h"

namespace emtb {
namespace {

constexpr std::size_t bin_count = 12;

/// As the contract calls them, with their units.
struct Naming {
  std::string_view name, unit;
};
constexpr std::array<Naming, condition_count> names{{{"acceleration", "rad/s2"},
                                                     {"angle", "rad"},
                                                     {"heat", "J"},
                                                     {"i_a", "A"},
                                                     {"omega", "rad/s"},
                                                     {"sign(omega)", ""},
                                                     {"t", "s"},
                                                     {"u_ref", "V"}}};

/// One reading: the condition it was taken in, the residual in SI and in units of sigma.
struct Point {
  double condition, residual, scaled;
};

double mean_over(const std::vector<double>& x, std::size_t first, std::size_t last) {
  double sum = 0;
  for (std::size_t k = first; k <= last; ++k) sum += x[k];
  return sum / static_cast<double>(last - first + 1);
}

ResidualMap map_of(Signal signal, Condition against, const std::vector<Point>& points) {
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

/// [J] lost in the armature from the beginning of a run to each grid point.
std::vector<double> heat_of(const Excitation& x, std::span<const double> i_a, double resistance) {
  std::vector<double> heat(x.t.size(), 0.0);
  for (std::size_t k = 1; k < heat.size(); ++k) {
    heat[k] = heat[k - 1] + resistance * i_a[k] * i_a[k] * (x.t[k] - x.t[k - 1]);
  }
  return heat;
}

double within_a_turn(double angle) {
  constexpr double turn = 2 * std::numbers::pi;
  return angle - turn * std::floor(angle / turn);
}

using Points = std::array<std::vector<Point>, condition_count>;

/// Adds the readings of one observation, each with the conditions that it was taken in.
void add_points(Points& points, const Record& record, const Observation& o, const Residuals& residuals,
                const Trajectory<double>& y, std::span<const double> heat, Part part) {
  const Excitation& x = record.excitation;
  const std::vector<double>& angle = x.angle.empty() ? y.theta : x.angle;
  const auto reading = [&](double share) { return static_cast<std::size_t>(share * static_cast<double>(o.size())); };
  for (std::size_t j = reading(part.from); j < reading(part.to); ++j) {
    const std::size_t a = o.first[j], k = o.last[j];
    const auto over = [&](const std::vector<double>& signal) { return mean_over(signal, a, k); };
    const double scaled = residuals.value[static_cast<Eigen::Index>(j)];
    const auto put = [&](Condition against, double condition) {
      points[static_cast<std::size_t>(against)].push_back({condition, scaled * o.sigma[j], scaled});
    };
    const double omega = over(y.omega);
    put(Condition::time, x.t[k]);
    put(Condition::speed, omega);
    put(Condition::direction, omega > 0 ? 1 : omega < 0 ? -1 : 0);
    put(Condition::current, over(y.i_a));
    put(Condition::heat, heat[k]);
    if (!o.slow) put(Condition::angle, within_a_turn(0.5 * (angle[a] + angle[k])));
    if (!x.u_ref.empty()) put(Condition::reference, x.u_ref[k]);
    const std::size_t before = a == k && a > 0 ? a - 1 : a;
    if (k > before) put(Condition::acceleration, (y.omega[k] - y.omega[before]) / (x.t[k] - x.t[before]));
  }
}

}  // namespace

std::string_view name_of(Condition condition) noexcept { return names[static_cast<std::size_t>(condition)].name; }
std::string_view unit_of(Condition condition) noexcept { return names[static_cast<std::size_t>(condition)].unit; }

std::vector<ResidualMap> residual_maps(std::span<const Record> records, const Model& model, Part part) {
  std::map<Signal, Points> points;
  const std::vector<double> values = model.values();
  // The conditions are those of the machine, not what its instruments make of them.
  const Model machine = without_sensors(model);
  const std::vector<double> machine_values = machine.values();
  for (std::size_t i = 0; i < records.size(); ++i) {
    const Record& record = records[i];
    Trajectory<double> y;
    simulate<double>(record.structure(machine), machine_values, record.excitation, y);
    const std::vector<double> heat = heat_of(record.excitation, y.i_a, machine_values[base::R_a]);
    const std::vector<Residuals> rs = residuals(records, i, record.structure(model), values, {});
    for (std::size_t s = 0; s < rs.size(); ++s) {
      const Observation& o = record.observations[s];
      add_points(points[o.signal], record, o, rs[s], y, heat, part);
    }
  }
  std::vector<ResidualMap> maps;
  for (const auto& [signal, of_signal] : points) {
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
