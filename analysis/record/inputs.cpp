#include "analysis/record/inputs.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/orders.h"
#include "analysis/numerics/scatter.h"
#include "analysis/record/driver_voltage.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// [s] Half the time over which a measured voltage or torque that drives the model is averaged, where nothing changes.
constexpr double longest_smoothing = 0.25;

/// The same in samples that are `interval` [s] apart.
std::size_t longest_reach(double interval) {
  return static_cast<std::size_t>(std::max(1.0, longest_smoothing / interval));
}

/// Means of x over [k - r, k + r].
class Means {
 public:
  explicit Means(std::span<const double> x) : sum_(x.size() + 1, 0.0) {
    std::partial_sum(x.begin(), x.end(), sum_.begin() + 1);
  }

  double operator()(std::size_t k, std::size_t r) const {
    return (sum_[k + r + 1] - sum_[k - r]) / static_cast<double>(2 * r + 1);
  }

 private:
  std::vector<double> sum_;
};

/// The mean of x over [k - half[k], k + half[k]], for every k.
std::vector<double> moving_mean(std::span<const double> x, std::span<const std::size_t> half) {
  const Means mean(x);
  std::vector<double> all(x.size());
  for (std::size_t k = 0; k < x.size(); ++k) {
    all[k] = mean(k, std::min({half[k], k, x.size() - 1 - k}));  // symmetric up to the ends: no delay
  }
  return all;
}

/// How far each grid point is from the next corner of a piecewise smooth voltage, in samples, at most `longest`.
std::vector<std::size_t> distance_to_corner(std::span<const double> e, double resolution, std::size_t longest) {
  const std::size_t n = e.size();
  std::vector<std::size_t> distance(n, longest);
  for (std::size_t k = 1; k + 1 < n; ++k) {
    if (std::abs(e[k + 1] - 2 * e[k] + e[k - 1]) > resolution) distance[k] = 0;
  }
  for (std::size_t k = 1; k < n; ++k) distance[k] = std::min(distance[k], distance[k - 1] + 1);
  for (std::size_t k = n - 1; k-- > 0;) distance[k] = std::min(distance[k], distance[k + 1] + 1);
  return distance;
}

/// How far around each sample the mean may reach before it differs from the mean over half of that by more than noise
/// can: a corner that nobody foresaw, of a driver that is not as known.
std::vector<std::size_t> trusted_reach(std::span<const double> x, std::vector<std::size_t> reach,
                                       const ColouredNoise& noise) {
  const Means mean(x);
  std::vector<double> tolerance(std::ranges::max(reach) / 2 + 1);
  for (std::size_t r = 0; r < tolerance.size(); ++r) {
    tolerance[r] = 2 * noise.of_mean(2.0 * static_cast<double>(r) + 1);
  }
  for (std::size_t k = 0; k < x.size(); ++k) {
    std::size_t& r = reach[k];
    r = std::min({r, k, x.size() - 1 - k});  // symmetric up to the ends: no delay
    while (r > 0 && std::abs(mean(k, r) - mean(k, r / 2)) > tolerance[r / 2]) r /= 2;
  }
  return reach;
}

/// The same where edges are many and none is foretold: twice as far as long as no mean differs from that over half of
/// it. From the longest down two means across several edges may agree by chance.
/// @param errors of a mean by which the two may differ
std::vector<std::size_t> reach_between_edges(std::span<const double> x, std::size_t longest, const ColouredNoise& noise,
                                             double errors) {
  const Means mean(x);
  std::vector<std::size_t> reach(x.size(), 0);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::size_t most = std::min({longest, k, x.size() - 1 - k});
    for (std::size_t r = 1; r <= most; r *= 2) {
      const std::size_t half = r / 2;
      if (std::abs(mean(k, r) - mean(k, half)) > errors * noise.of_mean(2.0 * static_cast<double>(half) + 1)) break;
      reach[k] = r;
    }
  }
  return reach;
}

/// What is left of the noise in the change from one moving mean to the next, which shares readings with it.
double change_of_means(const ColouredNoise& noise, std::size_t before, std::size_t now) {
  const auto b = static_cast<double>(before), n = static_cast<double>(now);
  const double shared = std::max(0.0, std::min(n, b - 1) - std::max(-n, -b - 1) + 1);
  const double of_before = 2 * b + 1, of_now = 2 * n + 1;
  const double of_one = 1 / of_before + 1 / of_now - 2 * shared / (of_before * of_now);
  return noise.sigma * std::sqrt(std::max(0.0, (1 - noise.autocorrelation) * of_one));
}

/// What is left of the noise in moving means. They take none of its slow part away, the product of variance and
/// correlation time: what they leave is smaller and lasts longer.
InputNoise noise_of_means(const ColouredNoise& noise, std::span<const std::size_t> half, double interval) {
  std::vector<double> sigmas, lasting, change;
  for (std::vector<double>* of : {&sigmas, &lasting, &change}) of->reserve(half.size());
  const double own = 0.5 * interval * (1 + noise.autocorrelation) / (1 - noise.autocorrelation);  // [s]
  for (std::size_t k = 0; k < half.size(); ++k) {
    const double sigma = noise.of_mean(2.0 * static_cast<double>(half[k]) + 1);
    sigmas.push_back(sigma);
    lasting.push_back(sigma > 0 ? own * noise.sigma * noise.sigma / (sigma * sigma) : own);
    change.push_back(k > 0 ? change_of_means(noise, half[k - 1], half[k]) : 0);
  }
  return {ErrorColumn(sigmas), ErrorColumn(lasting), ErrorColumn(change)};
}

/// What repeats with the angle of the shaft in a reading, by pieces of two seconds: a mean over a turn would take it
/// away with the noise.
std::vector<double> ripple_of(std::span<const double> x, std::span<const double> angle, double interval) {
  constexpr double piece = 2;  // [s]
  constexpr std::size_t most_orders = 3;
  std::vector<double> ripple(x.size(), 0.0);
  if (angle.empty()) return ripple;
  const std::vector<double> quick = without_slow_changes({x.begin(), x.end()}, interval);
  const auto size = static_cast<std::size_t>(std::max(16.0, std::round(piece / interval)));
  std::vector<TurningStretch> pieces;
  for (std::size_t from = 0; from < x.size(); from += size) {
    const auto begin = static_cast<std::ptrdiff_t>(from),
               end = static_cast<std::ptrdiff_t>(std::min(from + size, x.size()));
    pieces.push_back({{angle.begin() + begin, angle.begin() + end}, {quick.begin() + begin, quick.begin() + end}});
  }
  const std::vector<Order> orders = strong_orders(pieces, most_orders);
  if (orders.empty()) return ripple;
  std::size_t k = 0;
  for (TurningStretch& p : pieces) {
    remove_orders(p, orders);
    for (const double rest : p.value) {
      ripple[k] = quick[k] - rest;
      ++k;
    }
  }
  return ripple;
}

/// [V] By how much the driver's mean output from each time to the next exceeds that of both: it has corners in between,
/// where a reference that it follows with a slope is reached, and a driver that follows at once jumps there. Where
/// neither it nor its reference moves, there is none.
/// @param expected the driver's output at the times
std::vector<double> bulge_of(const Model& model, std::span<const double> values, const Excitation& x,
                             std::span<const double> expected) {
  constexpr int finer = 8;         // leaves 1/64 of a corner's bulge
  constexpr double across = 1e-6;  // of an interval: just beyond a jump
  const std::size_t n = x.t.size();
  const double late = x.acts_after / mean_interval(x.t), jump = late < 0 ? 1 + late : late;
  std::vector<double> places{jump};  // parts of an interval
  if (jump + across < 1) places.push_back(jump + across);
  for (int i = 0; i < finer; ++i) places.push_back(static_cast<double>(i) / finer);
  std::ranges::sort(places);
  places.erase(std::ranges::unique(places).begin(), places.end());
  if (places.back() >= 1) places.pop_back();
  const auto row_at = [&](std::size_t k, double place) {  // whose reference acts
    const std::size_t before = late > 0 && k > 0 ? k - 1 : k, after = late < 0 ? std::min(k + 1, n - 1) : k;
    return place < jump ? before : after;
  };
  const auto stands = [&](std::size_t k) {
    return expected[k] == expected[k + 1] && x.u_ref[k] == x.u_ref[row_at(k, 0)] && x.u_ref[k] == x.u_ref[row_at(k, 1)];
  };
  Excitation fine;
  fine.initial = x.initial;
  fine.longest_step = x.longest_step;
  fine.quick_step = x.quick_step;
  for (std::size_t k = 0; k + 1 < n; ++k) {
    for (const double place : stands(k) ? std::span(places).first(1) : std::span(places)) {
      fine.t.push_back(std::lerp(x.t[k], x.t[k + 1], place));
      fine.u_ref.push_back(x.u_ref[row_at(k, place)]);
    }
  }
  fine.t.push_back(x.t.back());
  fine.u_ref.push_back(x.u_ref.back());
  const std::vector<double> driver = driver_voltage(model, values, fine);
  std::vector<double> bulge(n, 0.0);
  std::size_t at = 0;  // the first of the row's places
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const double* e = &driver[at];
    at += stands(k) ? 1 : places.size();
    if (stands(k)) continue;
    double mean = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
      const double until = i + 1 < places.size() ? places[i + 1] : 1;
      mean += 0.5 * (e[i] + e[i + 1]) * (until - places[i]);
    }
    bulge[k] = mean - 0.5 * (e[0] + e[places.size()]);
  }
  return bulge;
}

}  // namespace

/// The series on the grid: the reading nearest to each grid point, at most half an interval away.
/// @throws ModelError where there are holes: what drives a simulation must be known throughout.
SharedColumn<double> on_grid(const Series& series, std::span<const double> grid, const std::string& what) {
  if (std::ranges::equal(series.t, grid)) return series.value;
  std::vector<double> values(grid.size());
  std::size_t j = 0;
  for (std::size_t k = 0; k < grid.size(); ++k) {
    while (j + 1 < series.t.size() && std::abs(series.t[j + 1] - grid[k]) <= std::abs(series.t[j] - grid[k])) ++j;
    const double interval = k > 0 ? grid[k] - grid[k - 1] : grid[std::min<std::size_t>(1, grid.size() - 1)] - grid[0];
    if (std::abs(series.t[j] - grid[k]) > 0.75 * interval + 1e-9) {
      throw ModelError(what + " has no reading near t = " + std::to_string(grid[k]) +
                       " s. What drives the model must be known throughout: cut the session with @T0:T1");
    }
    values[k] = series.value[j];
  }
  return values;
}

std::vector<double> SteadySpeed::quiet() const { return moving_mean(raw, reach); }

SteadySpeed unknown_speed(std::span<const double> grid) {
  const double interval = mean_interval(grid);
  return {{}, std::vector<std::size_t>(grid.size(), longest_reach(interval))};
}

SteadySpeed steady_speed(const Run& run, std::span<const double> grid) {
  const Series& omega = run.at(Signal::omega);
  SteadySpeed s{on_grid(omega, grid, run.name + ": omega_rad_s"), {}};
  const double interval = mean_interval(grid);
  const ColouredNoise noise = coloured_noise(s.raw, omega.lsb / std::sqrt(12.0));
  const auto longest = longest_reach(interval);
  s.reach = trusted_reach(s.raw, std::vector<std::size_t>(grid.size(), longest), noise);
  return s;
}

MeasuredInput measured_load(const std::string& run, const Series& torque, std::span<const double> grid,
                            std::span<const double> angle, std::vector<std::size_t> steady) {
  std::vector<double> raw = on_grid(torque, grid, run + ": torque_Nm");
  const double interval = mean_interval(grid);
  const std::vector<double> ripple = ripple_of(raw, angle, interval);
  std::ranges::transform(raw, ripple, raw.begin(), std::minus{});
  // A load that moves all the time is none of the gauge's noise.
  const ColouredNoise noise = coloured_noise(raw, torque.lsb / std::sqrt(12.0));
  constexpr double clear = 4;  // errors: an edge, for a brake that turns around
  const std::vector<std::size_t> to_an_edge = reach_between_edges(raw, std::ranges::max(steady), noise, clear);
  std::vector<std::size_t> half = trusted_reach(raw, std::move(steady), noise);
  for (std::size_t k = 0; k < half.size(); ++k) half[k] = std::min(half[k], to_an_edge[k]);
  std::vector<double> load = moving_mean(raw, half);
  std::ranges::transform(load, ripple, load.begin(), std::plus{});
  InputNoise left = noise_of_means(noise, half, interval);
  for (std::size_t k = 0; k < load.size(); ++k) {
    if (std::abs(load[k]) > 6 * left.sigma[k] + 2 * torque.lsb) return {std::move(load), std::move(left)};
  }
  return {};
}

MeasuredInput quiet_voltage(std::span<const double> e_a, double interval) {
  const ColouredNoise noise = white_noise(e_a);
  const std::vector<std::size_t> half = reach_between_edges(e_a, longest_reach(interval), noise, 2);
  return {moving_mean(e_a, half), noise_of_means(noise, half, interval)};
}

MeasuredVoltage measured_voltage(const std::string& run, const Series& e_a, const Excitation& x, const Model& model,
                                 double late) {
  const std::vector<double> measured = on_grid(e_a, x.t, run + ": e_a_V");
  const double interval = mean_interval(x.t);
  const auto longest = longest_reach(interval);
  const std::vector<double> values = model.values(), expected = driver_voltage(model, values, x);
  Excitation as_read = x;
  as_read.acts_after += late * interval;
  std::vector<double> added(measured.size());
  std::ranges::transform(measured, late > 0 ? driver_voltage(model, values, as_read) : expected, added.begin(),
                         std::minus{});
  const ColouredNoise noise = coloured_noise(added, e_a.lsb / std::sqrt(12.0));
  const auto half = trusted_reach(added, distance_to_corner(expected, 0.5 * noise.sigma, longest), noise);
  std::vector<double> quiet = moving_mean(added, half);
  for (std::size_t k = 0; k < quiet.size(); ++k) quiet[k] += expected[k];
  MeasuredVoltage voltage;
  voltage.value = std::move(quiet);
  voltage.noise = noise_of_means(noise, half, interval);
  voltage.bulge = bulge_of(model, values, x, expected);
  // Of a change that turns out smaller or larger than the driver's model has it, so much was read: it saturates, or
  // lets go of a motor whose own voltage stays.
  constexpr double clear = 12, twice = 2;  // errors; times, at most
  for (std::size_t k = 0; k + 1 < expected.size(); ++k) {
    const double told = expected[k + 1] - expected[k], read = voltage.value[k + 1] - voltage.value[k];
    if (std::abs(told) > clear * voltage.noise.sigma[k]) voltage.bulge[k] *= std::clamp(read / told, 0.0, twice);
  }
  return voltage;
}

}  // namespace emtb
