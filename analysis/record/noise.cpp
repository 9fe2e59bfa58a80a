#include "analysis/record/noise.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "analysis/numerics/orders.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/regression.h"
#include "analysis/numerics/scatter.h"
#include "analysis/numerics/statistics.h"

namespace emtb {
namespace {

constexpr double settled_stretch = 1.0;  ///< [s] shortest stretch that tells a scatter
constexpr std::size_t fewest_readings = 5;

/// Scatter about a straight line: variance, covariance of neighbours, how far the line rises over all readings, and
/// what it says of a reading before the first.
struct Scatter {
  double variance = 0, covariance = 0, rise = 0, before = 0;
};

Scatter scatter_about_line(std::span<const double> y) {
  const auto n = static_cast<double>(y.size());
  const double middle = (n - 1) / 2;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < y.size(); ++i) mean += y[i] / n;
  const double spread = n * (n * n - 1) / 12;
  for (std::size_t i = 0; i < y.size(); ++i) slope += (static_cast<double>(i) - middle) * (y[i] - mean) / spread;
  double squares = 0, products = 0, before = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double r = y[i] - mean - slope * (static_cast<double>(i) - middle);
    squares += r * r;
    if (i > 0) products += r * before;
    before = r;
  }
  const double variance = squares / (n - 2);
  return {variance, products / (n - 2), std::abs(slope) * n, mean - slope * (middle + 1)};
}

/// With what rounding leaves out, so that readings that are all the same have some.
double deviation(const Scatter& s, double lsb) { return std::sqrt(s.variance + lsb * lsb / 12); }

/// Still on its way: what bends in the readings would count as noise.
bool moves(std::span<const double> y, double lsb) {
  constexpr double far = 4;  // standard deviations
  const Scatter s = scatter_about_line(y);
  return s.rise > far * deviation(s, lsb);
}

/// The readings of a slow meter from where they no longer relax: the first ones are left out while they lie off the
/// line through the others. An exponential approach does so to its end, until steps of the meter hide it.
std::span<const double> settled_part(std::span<const double> y, double lsb) {
  constexpr double off = 2;  // standard errors of a prediction
  while (y.size() > fewest_readings) {
    const std::span<const double> others = y.subspan(1);
    const Scatter s = scatter_about_line(others);
    const auto n = static_cast<double>(others.size());
    const double error = deviation(s, lsb) * std::sqrt(1 + 1 / n + 3 * (n + 1) / (n * (n - 1)));
    if (std::abs(y.front() - s.before) <= off * error) break;
    y = others;
  }
  return y;
}

/// Half-open stretches of the grid over which the input does not change, for 1 s or more.
std::vector<std::pair<std::size_t, std::size_t>> constant_stretches(const Excitation& x,
                                                                    const std::vector<double>& input) {
  std::vector<std::pair<std::size_t, std::size_t>> stretches;
  const double tolerance = 6 * difference_scatter(input);
  std::size_t begin = 0;
  for (std::size_t k = 1; k <= input.size(); ++k) {
    if (k < input.size() && std::abs(input[k] - input[begin]) <= tolerance) continue;
    if (x.t[k - 1] - x.t[begin] >= settled_stretch) stretches.emplace_back(begin, k);
    begin = k;
  }
  return stretches;
}

/// The pieces of a signal in which nothing changes but noise, and what repeats with the angle or in time.
struct Settled {
  std::vector<TurningStretch> fast;
  std::vector<std::vector<double>> time;  ///< [s] of the fast ones' readings
  std::vector<std::vector<double>> slow;
  std::vector<std::vector<double>> short_slow;  ///< pieces of a slow meter that may be too short to tell a trend
};

/// Collects the settled pieces of one observation.
void collect(const PreparedRun& record, const Observation& o, Settled& settled) {
  const Excitation& x = record.excitation;
  const std::vector<double>& input = !x.u_ref.empty() ? x.u_ref : !x.e_a.empty() ? x.e_a : x.i_a;
  for (const auto& [begin, end] : constant_stretches(x, input)) {
    // The later half: the machine has had its time to settle. A slow meter is taken whole, a fast signal in pieces of 1
    // s.
    const double from = 0.5 * (x.t[begin] + x.t[end - 1]), until = x.t[end - 1];
    TurningStretch piece;
    std::vector<double> time;
    double piece_begin = from;
    const auto take = [&] {
      if (o.slow && piece.value.size() >= 2) settled.short_slow.push_back(piece.value);
      if (piece.value.size() < fewest_readings) return;
      if (o.slow) {
        const std::span<const double> part = settled_part(piece.value, o.lsb);
        if (!moves(part, o.lsb)) settled.slow.emplace_back(part.begin(), part.end());
      } else if (!moves(piece.value, o.lsb)) {
        settled.fast.push_back(piece);
        settled.time.push_back(time);
      }
    };
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double t = x.t[o.last[i]];
      if (x.t[o.first[i]] < from || t > until) continue;
      if (!o.slow && t - piece_begin >= settled_stretch) {
        take();
        piece = {};
        time.clear();
        piece_begin = t;
      }
      piece.value.push_back(o.value[i]);
      piece.angle.push_back(x.angle.empty() ? 0 : x.angle[o.last[i]]);
      time.push_back(t);
    }
    if (o.slow || until - piece_begin >= 0.9 * settled_stretch) take();
  }
}

/// Scatter by third differences, which a smooth movement of the signal leaves out: 1.4826 median|d3 x| / sqrt 20.
double third_difference_scatter(std::span<const double> x) {
  std::vector<double> differences;
  for (std::size_t k = 3; k < x.size(); ++k)
    differences.push_back(std::abs(x[k] - 3 * x[k - 1] + 3 * x[k - 2] - x[k - 3]));
  return differences.empty() ? 0 : robust_sigma(std::move(differences)) / std::sqrt(20.0);
}

/// Takes out of the settled pieces what repeats with the angle or, slower than any hum of the mains, in time: that is
/// no noise, something shakes the machine.
void remove_what_repeats(Settled& settled) {
  constexpr double slowest = 4, fastest = 30;  // [Hz]
  const auto enough = [](const TurningStretch& piece, std::size_t orders) { return piece.value.size() > 20 * orders; };
  const std::vector<Order> orders = strong_orders(settled.fast, 4);
  for (TurningStretch& piece : settled.fast) {
    if (enough(piece, orders.size())) remove_orders(piece, orders);
  }
  std::vector<TurningStretch> in_time;
  for (std::size_t i = 0; i < settled.fast.size(); ++i) {
    in_time.push_back({settled.time[i], settled.fast[i].value});
    for (double& t : in_time.back().angle) t *= 2 * std::numbers::pi;
  }
  const std::vector<Order> lines = strong_orders(in_time, 2, slowest, fastest);
  for (std::size_t i = 0; i < settled.fast.size(); ++i) {
    if (enough(in_time[i], lines.size())) remove_orders(in_time[i], lines);
    settled.fast[i].value = std::move(in_time[i].value);
  }
}

/// Scatter of the neighbours in pieces too short for a trend: by the median, since a piece may begin before all has
/// settled. Negative where there are too few to tell.
double scatter_of_neighbours(const std::vector<std::vector<double>>& pieces) {
  constexpr std::size_t fewest = 6;
  std::vector<double> differences;
  for (const auto& piece : pieces) {
    for (std::size_t i = 1; i < piece.size(); ++i) differences.push_back(std::abs(piece[i] - piece[i - 1]));
  }
  return differences.size() >= fewest ? robust_sigma(std::move(differences)) / std::sqrt(2.0) : -1;
}

/// A signal on the grid: each reading holds until the next.
std::vector<double> held_on_grid(const Observation& o, std::size_t size) {
  std::vector<double> values(size, o.size() > 0 ? o.value.front() : 0);
  for (std::size_t i = 0; i < o.size(); ++i) {
    const std::size_t end = i + 1 < o.size() ? o.last[i + 1] : size;
    for (std::size_t k = o.last[i]; k < end; ++k) values[k] = o.value[i];
  }
  return values;
}

/// Scatter of a slow meter about what the fast signals beside it, averaged over its windows, say in a straight line:
/// voltage, speed, direction, acceleration. What no line says counts as noise: an upper bound, for where nothing ever
/// settles for as long as the meter takes. Negative where there are no such signals.
double scatter_about_fast_signals(std::span<const PreparedRun> records, Signal signal) {
  std::vector<std::vector<double>> columns(5);
  std::vector<double> readings;
  for (const PreparedRun& record : records) {
    const Excitation& x = record.excitation;
    const auto find = [&](Signal of) { return std::ranges::find(record.observations, of, &Observation::signal); };
    const auto slow = find(signal), fast = find(Signal::omega), end = record.observations.end();
    if (slow == end || fast == end || fast->slow) continue;
    const std::vector<double> omega = held_on_grid(*fast, x.t.size());
    const std::vector<double>& drive = !x.e_a.empty() ? x.e_a : x.u_ref;
    if (drive.empty()) return -1;
    for (std::size_t i = 0; i < slow->size(); ++i) {
      const std::size_t a = slow->first[i], b = slow->last[i];
      double voltage = 0, speed = 0, direction = 0;
      const double n = static_cast<double>(b - a + 1);
      for (std::size_t k = a; k <= b; ++k) {
        voltage += drive[k] / n;
        speed += omega[k] / n;
        direction += (omega[k] > 0 ? 1 : -1) / n;
      }
      columns[0].push_back(1);
      columns[1].push_back(voltage);
      columns[2].push_back(speed);
      columns[3].push_back(direction);
      columns[4].push_back(omega[b] - omega[a]);
      readings.push_back(slow->value[i]);
    }
  }
  if (readings.size() < 4 * columns.size()) return -1;
  const Regression line = regress(columns, readings);
  std::vector<double> left;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    double predicted = 0;
    for (std::size_t c = 0; c < columns.size(); ++c) predicted += line.value[c] * columns[c][i];
    left.push_back(std::abs(readings[i] - predicted));
  }
  return robust_sigma(std::move(left));
}

/// The reference is set, so that it is the same where a run was repeated: to a digit of the card that reads it back.
bool repeats(const PreparedRun& a, const PreparedRun& b) {
  const std::vector<double>&x = a.excitation.u_ref, &y = b.excitation.u_ref;
  const std::size_t n = std::min(x.size(), y.size());
  if (n == 0 || static_cast<double>(n) < 0.98 * static_cast<double>(std::max(x.size(), y.size()))) return false;
  double range = 0;
  for (const double u : x) range = std::max(range, std::abs(u));
  std::size_t apart = 0;  // where an edge fell between other readings
  for (std::size_t k = 0; k < n; ++k) apart += std::abs(x[k] - y[k]) > 0.005 * range;
  return 200 * apart <= n;
}

/// Half the scatter of what repeated runs differ by, in pieces of 1 s about a straight line each: what drifts from run
/// to run, as a motor that warms, is no noise.
std::vector<Scatter> scatter_between_repeats(std::span<const PreparedRun> records, Signal signal) {
  std::vector<Scatter> pieces;
  const auto piece_of = [&](std::vector<double>& differences) {
    if (differences.size() >= 2 * fewest_readings) {
      Scatter s = scatter_about_line(differences);
      s.variance /= 2;
      s.covariance /= 2;
      pieces.push_back(s);
    }
    differences.clear();
  };
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto next = std::find_if(records.begin() + static_cast<std::ptrdiff_t>(i) + 1, records.end(),
                                   [&](const PreparedRun& other) { return repeats(records[i], other); });
    if (next == records.end()) continue;
    const auto find = [&](const PreparedRun& r) {
      return std::ranges::find(r.observations, signal, &Observation::signal);
    };
    const auto one = find(records[i]), other = find(*next);
    if (one == records[i].observations.end() || other == next->observations.end()) continue;
    const std::vector<double>&t = records[i].excitation.t, &u = next->excitation.t;
    std::vector<double> differences;
    double begin = t.front();
    for (std::size_t k = 0; k < std::min(one->size(), other->size()); ++k) {
      const double at = t[one->last[k]];
      const double interval = k > 0 ? at - t[one->last[k - 1]] : 0;
      if (k > 0 && std::abs(at - u[other->last[k]]) > 0.5 * interval) break;  // readings that do not go side by side
      differences.push_back(one->value[k] - other->value[k]);
      if (at - begin >= std::max(settled_stretch, 20 * interval)) {
        piece_of(differences);
        begin = at;
      }
    }
    piece_of(differences);
  }
  return pieces;
}

NoiseFloor floor_of(Signal signal, std::span<const PreparedRun> records) {
  NoiseFloor floor;
  Settled settled;
  std::vector<const Observation*> observed;
  double lsb = 0;
  bool slow = false;
  for (const PreparedRun& record : records) {
    for (const Observation& o : record.observations) {
      if (o.signal != signal) continue;
      slow = o.slow;
      observed.push_back(&o);
      collect(record, o, settled);
      lsb = std::max(lsb, o.lsb);
    }
  }
  remove_what_repeats(settled);
  std::vector<double> variances, correlations;
  const auto take = [&](std::span<const double> piece) {
    const Scatter s = scatter_about_line(piece);
    variances.push_back(s.variance);
    if (s.variance > 0) correlations.push_back(s.covariance / s.variance);
  };
  for (const TurningStretch& piece : settled.fast) take(piece.value);
  for (const auto& piece : settled.slow) take(piece);
  const auto pooled = [&](const char* from) {
    floor.sigma = std::sqrt(median(variances));
    floor.from = from;
    if (!correlations.empty()) floor.autocorrelation = std::clamp(median(correlations), -0.99, 0.999);
  };
  const auto take_repeats = [&] {
    variances.clear();
    correlations.clear();
    for (const Scatter& s : scatter_between_repeats(records, signal)) {
      variances.push_back(s.variance);
      if (s.variance > 0) correlations.push_back(s.covariance / s.variance);
    }
    return variances.size() >= 2;
  };
  if (variances.size() >= 2) {
    pooled("settled");
  } else if (const double scatter = scatter_of_neighbours(settled.short_slow); scatter >= 0) {
    floor.sigma = scatter;
    floor.from = "settled";
  } else if (take_repeats()) {
    pooled("repeats");
  } else {
    std::vector<double> differences;
    for (const Observation* o : observed) differences.push_back(third_difference_scatter(o->value));
    floor.sigma = median(std::move(differences));
    floor.from = "differences";
    floor.lower_bound = true;
  }
  if (slow) {
    // The readings may all span a change, or a relaxation whose last part passes for settled: then their scatter is
    // that of the current itself.
    constexpr double clearly = 0.7;
    const double beside = scatter_about_fast_signals(records, signal);
    if (beside >= 0 && beside < (floor.lower_bound ? 1 : clearly) * floor.sigma) {
      floor = {};
      floor.sigma = beside;
      floor.from = "regression";
    }
  }
  if (const double resolution = lsb / std::sqrt(12.0); floor.sigma < resolution) {
    floor.sigma = resolution;
    floor.from = "resolution";
    floor.lower_bound = false;
  }
  return floor;
}

}  // namespace

Noise estimate_noise(std::span<const PreparedRun> records, const Model& model) {
  std::map<Signal, const Observation*> first;
  for (const PreparedRun& record : records) {
    for (const Observation& o : record.observations) first.try_emplace(o.signal, &o);
  }
  const std::vector<std::pair<Signal, const Observation*>> signals(first.begin(), first.end());
  std::vector<NoiseFloor> floors(signals.size());
  parallel_for(signals.size(), [&](std::size_t i) {
    const auto& [signal, o] = signals[i];
    floors[i] = floor_of(signal, records);
    if (const auto declared = model.noise.find(signal); declared != model.noise.end()) {
      floors[i].sigma = std::max(declared->second, o->lsb / std::sqrt(12.0));
      floors[i].from = "declared";
      floors[i].lower_bound = false;
    }
    if (floors[i].sigma <= 0) floors[i].sigma = 1e-9;  // a signal without any scatter at all: nothing to weigh by
  });
  Noise noise;
  for (std::size_t i = 0; i < signals.size(); ++i) noise[signals[i].first] = floors[i];
  return noise;
}

namespace {

/// How the noise of what drives a model shows in what it predicts: the motor as a first-order lag from torque to speed.
class CarriedNoise {
 public:
  CarriedNoise(const PreparedRun& record, std::span<const double> values, bool driven_by_current)
      : record_(record), R_a_(values[0]), K_b_(values[1]), K_m_(values[2]), driven_by_current_(driven_by_current) {
    const double damping = values[3] + (driven_by_current ? 0 : K_b_ * K_m_ / R_a_);  // [N m s/rad]
    speed_per_torque_ = 1 / std::max(damping, 1e-12);
    time_constant_ = values[4] * speed_per_torque_;
  }

  /// Variance of a reading's prediction around grid point k.
  /// @param window [s] over which the reading averages
  double variance(Signal signal, std::size_t k, double window) const {
    const auto through_speed = [&](const InputNoise& noise, double torque_per_input) {
      if (noise.sigma.empty()) return 0.0;
      const double speed = speed_per_torque_ * torque_per_input * noise.sigma[k], correlated = noise.correlated[k];
      const double lasting = correlated + time_constant_;
      return speed * speed * correlated / lasting * averaged(lasting, window);
    };
    const double by_voltage = driven_by_current_ ? 0 : through_speed(record_.voltage_noise, K_m_ / R_a_);
    const double speed = through_speed(record_.load_noise, 1) + by_voltage;
    if (signal == Signal::omega) return speed;
    if (signal != Signal::i_a || driven_by_current_) return 0;
    const InputNoise& voltage = record_.voltage_noise;
    const double direct = voltage.sigma.empty() ? 0 : voltage.sigma[k] / R_a_;
    const double through = K_b_ / R_a_;
    return through * through * speed +
           (voltage.sigma.empty() ? 0 : direct * direct * averaged(voltage.correlated[k], window));
  }

 private:
  static double averaged(double lasting, double window) { return std::min(1.0, 2 * lasting / std::max(window, 1e-9)); }

  const PreparedRun& record_;
  double R_a_, K_b_, K_m_;
  bool driven_by_current_;
  double speed_per_torque_ = 0;  ///< [rad/s per N m]
  double time_constant_ = 0;     ///< [s]
};

/// Where the angle is the integral of a speed: what noise makes it wander, and how far a simulated rotor trusts it.
void set_wander(PreparedRun& record, const Noise& noise) {
  constexpr double longest_memory = 0.99;  // of the noise, from one reading to the next
  constexpr double more = 4;               // also what rounds the reading, and what lags
  constexpr double window = 0.1;           // [s] over which a shaft turns or stands
  constexpr double clear = 4;              // standard deviations of noise above which it turns
  constexpr double back = 4;  // [1/rad] a rotor that turns is back at a measured angle within a part of a turn
  Excitation& x = record.excitation;
  const auto speed = std::ranges::find(record.observations, Signal::omega, &Observation::signal);
  if (!x.angle_integrated || speed == record.observations.end() || speed->size() < 2) return;
  const double interval = (x.t[speed->last.back()] - x.t[speed->last.front()]) / static_cast<double>(speed->size() - 1);
  const NoiseFloor& floor = noise.at(Signal::omega);
  const double rho = std::clamp(floor.autocorrelation, 0.0, longest_memory);
  const double by_noise = floor.sigma * floor.sigma * interval * (1 + rho) / (1 - rho);  // [rad^2/s]
  record.angle_wander = more * by_noise;
  const std::size_t n = x.t.size();
  const auto half =
      static_cast<std::size_t>(std::lround(0.5 * window * static_cast<double>(n - 1) / (x.t.back() - x.t.front())));
  x.angle_pull.assign(n, 0);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t from = k - std::min(k, half), to = std::min(k + half, n - 1);
    const double seconds = x.t[to] - x.t[from];
    if (seconds <= 0) continue;
    const double turning = std::abs(x.angle[to] - x.angle[from]) / seconds;
    x.angle_pull[k] = back * std::max(0.0, turning - clear * std::sqrt(by_noise / seconds));
  }
}

}  // namespace

void weigh(std::span<PreparedRun> records, const Noise& noise, const Model& model) {
  const std::vector<double> values = model.values();
  for (PreparedRun& record : records) {
    const CarriedNoise carried(record, values, model.input == Signal::i_a);
    const Excitation& x = record.excitation;
    set_wander(record, noise);
    Trajectory<double> driver;
    if (!x.u_ref.empty()) {
      ModelStructure structure = model.structure();
      structure.measured_voltage = false;
      simulate<double>(structure, values, x, driver);
    }
    for (Observation& o : record.observations) {
      const double floor = noise.at(o.signal).sigma;
      o.sigma.assign(o.size(), floor);
      for (std::size_t i = 0; i < o.size(); ++i) {
        double widened = floor * floor;
        const std::size_t k = o.last[i];
        if (o.signal == Signal::e_a && !driver.e_a.empty()) {
          // Half a sample of timing error on an edge looks like an output resistance, a delay or a lag.
          const std::size_t before = k > 0 ? k - 1 : k, after = std::min(k + 1, x.t.size() - 1);
          const double change =
              std::max(std::abs(driver.e_a[after] - driver.e_a[k]), std::abs(driver.e_a[k] - driver.e_a[before]));
          widened += change * change;
        }
        const std::size_t middle = (o.first[i] + o.last[i]) / 2;
        if (!o.increment) widened += carried.variance(o.signal, middle, x.t[k] - x.t[o.first[i]]);
        o.sigma[i] = std::sqrt(widened);
      }
    }
  }
}

}  // namespace emtb
