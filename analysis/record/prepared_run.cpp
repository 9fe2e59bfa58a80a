#include "analysis/record/prepared_run.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "analysis/numerics/orders.h"
#include "analysis/numerics/scatter.h"
#include "analysis/record/shaft_angle.h"
#include "hal/error.h"

namespace emtb {
namespace {

/// [s] Half the time over which a measured voltage or torque that drives the model is averaged, where nothing changes.
constexpr double longest_smoothing = 0.25;

/// The same in samples that are `interval` [s] apart.
std::size_t longest_reach(double interval) {
  return static_cast<std::size_t>(std::max(1.0, longest_smoothing / interval));
}

/// The mean of x over [k - half[k], k + half[k]], for every k.
std::vector<double> moving_mean(std::span<const double> x, std::span<const std::size_t> half) {
  std::vector<double> sum(x.size() + 1, 0.0), mean(x.size());
  std::partial_sum(x.begin(), x.end(), sum.begin() + 1);
  for (std::size_t k = 0; k < x.size(); ++k) {
    const std::size_t reach = std::min({half[k], k, x.size() - 1 - k});  // symmetric up to the ends: no delay
    mean[k] = (sum[k + reach + 1] - sum[k - reach]) / static_cast<double>(2 * reach + 1);
  }
  return mean;
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

/// The series on the grid: the reading nearest to each grid point, at most half an interval away.
/// @throws ModelError where there are holes: what drives a simulation must be known throughout.
std::vector<double> on_grid(const Series& series, std::span<const double> grid, const std::string& what) {
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

std::uint32_t nearest(std::span<const double> grid, double t) {
  const auto above = std::ranges::lower_bound(grid, t);
  if (above == grid.begin()) return 0;
  if (above == grid.end()) return static_cast<std::uint32_t>(grid.size() - 1);
  const auto below = above - 1;
  return static_cast<std::uint32_t>((t - *below < *above - t ? below : above) - grid.begin());
}

/// @param slow each reading is a mean: over its window, or since the reading before it
Observation observe(const Series& series, Signal signal, std::span<const double> grid, bool slow) {
  Observation o;
  o.signal = signal;
  o.lsb = series.lsb;
  o.slow = slow;
  const double interval = (grid.back() - grid.front()) / static_cast<double>(grid.size() - 1);
  for (std::size_t i = 0; i < series.t.size(); ++i) {
    const std::uint32_t end = nearest(grid, series.t[i]);
    if (std::abs(grid[end] - series.t[i]) > 0.75 * interval) continue;  // beyond what drives the model
    std::uint32_t begin = end;
    if (o.slow) {
      if (i == 0 && series.window <= 0) continue;  // the mean since a reading that is not there
      const double start = series.window > 0 ? series.t[i] - series.window : series.t[i - 1];
      if (start < grid.front() - 0.75 * interval) continue;
      begin = nearest(grid, start);
    }
    o.first.push_back(begin);
    o.last.push_back(end);
    o.value.push_back(series.value[i]);
  }
  return o;
}

/// How far around each sample the mean may reach before it differs from the mean over half of that by more than noise
/// can: a corner that nobody foresaw, of a driver that is not as known.
std::vector<std::size_t> trusted_reach(std::span<const double> x, std::vector<std::size_t> reach,
                                       const ColouredNoise& noise) {
  std::vector<double> sum(x.size() + 1, 0.0);
  std::partial_sum(x.begin(), x.end(), sum.begin() + 1);
  const auto mean = [&](std::size_t k, std::size_t r) {
    return (sum[k + r + 1] - sum[k - r]) / static_cast<double>(2 * r + 1);
  };
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

/// What is left of the noise in moving means. They take none of its slow part away, the product of variance and
/// correlation time: what they leave is smaller and lasts longer.
InputNoise noise_of_means(const ColouredNoise& noise, std::span<const std::size_t> half, double interval) {
  InputNoise left;
  const double own = 0.5 * interval * (1 + noise.autocorrelation) / (1 - noise.autocorrelation);  // [s]
  for (const std::size_t r : half) {
    const double sigma = noise.of_mean(2.0 * static_cast<double>(r) + 1);
    left.sigma.push_back(sigma);
    left.correlated.push_back(sigma > 0 ? own * noise.sigma * noise.sigma / (sigma * sigma) : own);
  }
  return left;
}

/// A measured speed on the grid, and how far around each sample it stands still for all that its noise tells.
struct SteadySpeed {
  std::vector<double> raw;
  std::vector<std::size_t> reach;
};

SteadySpeed steady_speed(const Run& run, std::span<const double> grid) {
  const Series& omega = run.at(Signal::omega);
  SteadySpeed s{on_grid(omega, grid, run.name + ": omega_rad_s"), {}};
  const double interval = (grid.back() - grid.front()) / static_cast<double>(grid.size() - 1);
  const ColouredNoise noise = coloured_noise(s.raw, omega.lsb / std::sqrt(12.0));
  const auto longest = longest_reach(interval);
  s.reach = trusted_reach(s.raw, std::vector<std::size_t>(grid.size(), longest), noise);
  return s;
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

/// The gauge's reading as a load, its noise averaged away where it stands still, and the speed with it: a load that
/// hangs on the speed changes with that, long before its own noise tells. Nothing where it reads zero throughout: then
/// K_m, B, J and the frictions share a common factor anyway, and a load of pure noise would only add its noise.
/// @param steady how far around each sample; at most
void load_with_measured_torque(PreparedRun& record, const Series& torque, std::vector<std::size_t> steady) {
  const std::span<const double> grid = record.excitation.t;
  std::vector<double> raw = on_grid(torque, grid, record.name + ": torque_Nm");
  const double interval = (grid.back() - grid.front()) / static_cast<double>(grid.size() - 1);
  const std::vector<double> ripple = ripple_of(raw, record.excitation.angle, interval);
  std::ranges::transform(raw, ripple, raw.begin(), std::minus{});
  const ColouredNoise noise = coloured_noise(raw, torque.lsb / std::sqrt(12.0));
  const std::vector<std::size_t> half = trusted_reach(raw, std::move(steady), noise);
  std::vector<double> load = moving_mean(raw, half);
  std::ranges::transform(load, ripple, load.begin(), std::plus{});
  InputNoise left = noise_of_means(noise, half, interval);
  bool loaded = false;
  for (std::size_t k = 0; k < load.size() && !loaded; ++k) {
    loaded = std::abs(load[k]) > 6 * left.sigma[k] + 2 * torque.lsb;
  }
  if (!loaded) return;
  record.load_noise = std::move(left);
  record.excitation.load = std::move(load);
  record.measured_load = true;
}

/// [V] By how much the driver's mean output from each time to the next exceeds that of both: it has corners in between,
/// where a reference that it follows with a slope is reached.
std::vector<double> bulge_of(const ModelStructure& driver, std::span<const double> parameters, const Excitation& x) {
  constexpr std::size_t finer = 8;  // leaves 1/64 of the bulge
  const std::size_t n = x.t.size();
  Excitation fine;
  fine.initial = x.initial;
  fine.longest_step = x.longest_step;
  fine.quick_step = x.quick_step;
  for (std::size_t k = 0; k < n; ++k) {
    const double interval = k + 1 < n ? x.t[k + 1] - x.t[k] : 0;
    for (std::size_t i = 0; i < (k + 1 < n ? finer : 1); ++i) {
      fine.t.push_back(x.t[k] + interval * static_cast<double>(i) / finer);
      fine.u_ref.push_back(x.u_ref[k]);
    }
  }
  Trajectory<double> y;
  simulate<double>(driver, parameters, fine, y);
  std::vector<double> bulge(n, 0.0);
  for (std::size_t k = 0; k + 1 < n; ++k) {
    const double *e = &y.e_a[k * finer], ends = 0.5 * (e[0] + e[finer]);
    double mean = ends / finer;
    for (std::size_t i = 1; i < finer; ++i) mean += e[i] / finer;
    bulge[k] = mean - ends;
  }
  return bulge;
}

/// The measured terminal voltage, as quiet as can be without touching its edges: the driver's model plus the zero-phase
/// mean of what the measurement adds to it, over +-0.25 s but never across a corner of the voltage.
void drive_with_measured_voltage(PreparedRun& record, const Series& e_a, const Model& model) {
  Excitation& x = record.excitation;
  const std::vector<double> measured = on_grid(e_a, x.t, record.name + ": e_a_V");
  const double interval = (x.t.back() - x.t.front()) / static_cast<double>(x.t.size() - 1);
  const auto longest = longest_reach(interval);
  Trajectory<double> driver;
  const std::vector<double> values = model.values();
  ModelStructure structure = model.structure();
  structure.measured_voltage = false;
  simulate<double>(structure, values, x, driver);
  const std::vector<double>& expected = driver.e_a;
  std::vector<double> added(measured.size());
  std::ranges::transform(measured, expected, added.begin(), std::minus{});
  const ColouredNoise noise = coloured_noise(added, e_a.lsb / std::sqrt(12.0));
  const auto half = trusted_reach(added, distance_to_corner(expected, 0.5 * noise.sigma, longest), noise);
  std::vector<double> quiet = moving_mean(added, half);
  for (std::size_t k = 0; k < quiet.size(); ++k) quiet[k] += expected[k];
  record.voltage_noise = noise_of_means(noise, half, interval);
  structure.measured_load = false;
  x.e_a_bulge = bulge_of(structure, values, x);
  x.e_a = std::move(quiet);
}

/// Where the run starts: at rest unless the first readings say otherwise.
double first_speed(const Observation& omega, std::span<const double> grid) {
  if (omega.slow) return 0;
  // As many readings as the speed hardly changes in: 30 ms, three at the least.
  std::size_t n = 0;
  while (n < omega.size() && (n < 3 || grid[omega.last[n]] < grid.front() + 0.03)) ++n;
  if (n < 3) return 0;
  // Straight line through the first readings; its value at the start and how sure that is.
  double st = 0, sy = 0, stt = 0, sty = 0;
  const auto time_of = [&](std::size_t i) { return 0.5 * (grid[omega.first[i]] + grid[omega.last[i]]) - grid.front(); };
  for (std::size_t i = 0; i < n; ++i) {
    const double t = time_of(i);
    st += t, sy += omega.value[i], stt += t * t, sty += t * omega.value[i];
  }
  const double count = static_cast<double>(n);
  const double slope = (count * sty - st * sy) / (count * stt - st * st);
  const double start = (sy - slope * st) / count;
  double squares = 0;
  for (std::size_t i = 0; i < n; ++i) squares += std::pow(omega.value[i] - start - slope * time_of(i), 2);
  const double error = 2 * std::sqrt(squares / std::max(1.0, count - 2) / count) + omega.lsb;
  return std::abs(start) > 3 * error ? start : 0;
}

/// What an encoder counts over 20 ms or more, span after span: beside a tachogenerator, which it judges.
Observation angle_increments(const Series& theta, std::span<const double> grid) {
  const double interval = (grid.back() - grid.front()) / static_cast<double>(grid.size() - 1);
  const auto span = static_cast<std::size_t>(std::max(2.0, std::round(0.02 / interval)));
  Observation o;
  o.signal = Signal::theta;
  o.lsb = theta.lsb;
  o.increment = true;
  const Observation angle = observe(theta, Signal::theta, grid, false);
  for (std::size_t i = span; i < angle.size(); i += span) {
    o.first.push_back(angle.last[i - span]);
    o.last.push_back(angle.last[i]);
    o.value.push_back(angle.value[i] - angle.value[i - span]);
  }
  return o;
}

}  // namespace

ModelStructure PreparedRun::structure(const Model& model) const {
  ModelStructure s = model.structure();
  s.measured_voltage = measured_voltage;
  s.measured_load = measured_load;
  return s;
}

Series speed_from_angle(const Series& theta, std::size_t half) {
  Series omega;
  omega.source = "slope of " + theta.source;
  const std::size_t n = theta.t.size();
  if (n <= 2 * half) return omega;
  double squares = 0;
  for (std::size_t j = 1; j <= half; ++j) squares += 2.0 * static_cast<double>(j * j);
  for (std::size_t k = half; k + half < n; k += half) {  // closer ones would share most of their noise
    double sum = 0;
    for (std::size_t j = 1; j <= half; ++j) sum += static_cast<double>(j) * (theta.value[k + j] - theta.value[k - j]);
    const double interval = (theta.t[k + half] - theta.t[k - half]) / (2.0 * static_cast<double>(half));
    omega.t.push_back(theta.t[k]);
    omega.value.push_back(sum / squares / interval);
  }
  return omega;
}

PreparedRun prepare_run(const Run& run, const Model& model, Chaining chaining) {
  return prepare_run(run, model, chaining, ripple_order(std::span(&run, 1)));
}

PreparedRun prepare_run(const Run& run, const Model& model, Chaining chaining, std::optional<double> order) {
  const SignalInfo& input = info(model.input);
  if (!run.has(model.input)) {
    throw ModelError(run.name + " has no " + std::string(input.column) + ", the input of model `" + model.name +
                     "`. Record it, map it with --map, or give the model another `input`");
  }
  PreparedRun record;
  record.name = run.name;
  Excitation& x = record.excitation;
  const Series& grid = run.at(model.input);
  if (grid.t.size() < 10) throw ModelError(run.name + " is too short: " + std::to_string(grid.t.size()) + " samples");
  x.t = grid.t;
  (model.input == Signal::u_ref ? x.u_ref : model.input == Signal::e_a ? x.e_a : x.i_a) = grid.value;
  if (run.has(Signal::armature_open)) {
    for (const double open : on_grid(run.at(Signal::armature_open), x.t, run.name + ": armature_open")) {
      x.armature_open.push_back(open > 0.5);
    }
  }

  const auto add = [&](Signal signal, const Series& series) {
    const bool slow = series.window > 0 || 2 * series.t.size() < x.t.size();
    Observation o = observe(series, signal, x.t, slow);
    if (o.size() > 0) record.observations.push_back(std::move(o));
  };
  const double interval = (x.t.back() - x.t.front()) / static_cast<double>(x.t.size() - 1);
  if (run.has(Signal::omega)) {
    add(Signal::omega, run.at(Signal::omega));
    if (run.has(Signal::theta)) {
      Observation o = angle_increments(run.at(Signal::theta), x.t);
      if (o.size() > 0) record.observations.push_back(std::move(o));
    }
  } else if (run.has(Signal::theta)) {
    // 21 ms are short against any shaft here and long against the encoder's steps.
    const auto half = static_cast<std::size_t>(std::max(2.0, std::round(0.01 / interval)));
    Observation o = observe(speed_from_angle(run.at(Signal::theta), half), Signal::omega, x.t, false);
    // The line's slope is a weighted mean of the speed over +-half; a plain mean over 0.775 of it has the same spread.
    const auto reach = static_cast<std::uint32_t>(std::lround(std::sqrt(0.6) * static_cast<double>(half)));
    for (std::size_t i = 0; i < o.size(); ++i) {
      o.first[i] -= std::min(o.first[i], reach);
      o.last[i] = std::min(o.last[i] + reach, static_cast<std::uint32_t>(x.t.size() - 1));
    }
    if (o.size() > 0) record.observations.push_back(std::move(o));
  }
  MeasuredAngle measured = measured_angle(run, x.t, order);
  x.angle = std::move(measured.angle);
  x.angle_integrated = measured.wanders;
  if (run.has(Signal::temperature)) {
    x.temperature = on_grid(run.at(Signal::temperature), x.t, run.name + ": temperature_degC");
  }
  if (run.has(Signal::i_a) && model.input != Signal::i_a) add(Signal::i_a, run.at(Signal::i_a));
  if (run.has(Signal::torque)) {
    add(Signal::torque, run.at(Signal::torque));
    const auto longest = longest_reach(interval);
    SteadySpeed speed{{}, std::vector<std::size_t>(x.t.size(), longest)};
    if (run.has(Signal::omega)) speed = steady_speed(run, x.t);
    load_with_measured_torque(record, run.at(Signal::torque), speed.reach);
    // What load effects see: noise that enters the predicted torque looks like a gauge that is too quick.
    if (record.measured_load && run.has(Signal::omega)) x.omega = moving_mean(speed.raw, speed.reach);
  }
  if (run.has(Signal::e_a) && model.input == Signal::u_ref) {
    add(Signal::e_a, run.at(Signal::e_a));
    if (chaining == Chaining::staged && 2 * run.at(Signal::e_a).t.size() > x.t.size()) {
      drive_with_measured_voltage(record, run.at(Signal::e_a), model);
      record.measured_voltage = true;
    }
  } else if (model.input == Signal::e_a) {
    record.measured_voltage = true;
  }
  // A step is exact for a linear motor under a steady voltage. At a tenth of the mechanical time constant what the
  // effects add at its middle is good to 1e-3; those with a time constant of their own need a fiftieth.
  const double time_constant = model.mechanical_time_constant();
  x.longest_step = std::clamp(time_constant / 10, 2e-4, 1e-2);
  x.quick_step = std::clamp(time_constant / 50, 2e-4, 1e-2);
  if (record.observations.empty()) {
    throw ModelError(run.name + " holds nothing to compare the model with: add omega_rad_s, theta_rad or i_a_A");
  }
  x.initial.as_read = true;
  x.initial.field_on = run.field_on;
  for (const Observation& o : record.observations) {
    if (o.signal == Signal::omega) x.initial.omega = first_speed(o, x.t);
    if (o.signal == Signal::i_a && !o.slow) x.initial.i_a = o.value.front();
  }
  return record;
}

}  // namespace emtb
