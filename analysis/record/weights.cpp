#include "analysis/record/weights.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/numerics/equal_readings.h"
#include "analysis/record/driver_voltage.h"

namespace emtb {
namespace {

/// How the noise of what drives a model shows in what it predicts: the motor as a first-order lag from torque to speed.
class CarriedNoise {
 public:
  CarriedNoise(const ObservedRun& record, std::span<const double> values, bool driven_by_current)
      : record_(record),
        R_a_(values[base::R_a]),
        K_b_(values[base::K_b]),
        K_m_(values[base::K_m]),
        driven_by_current_(driven_by_current) {
    const double damping = values[base::B] + (driven_by_current ? 0 : K_b_ * K_m_ / R_a_);  // [N m s/rad]
    speed_per_torque_ = 1 / std::max(damping, 1e-12);
    time_constant_ = values[base::J] * speed_per_torque_;
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

  const ObservedRun& record_;
  double R_a_, K_b_, K_m_;
  bool driven_by_current_;
  double speed_per_torque_ = 0;  ///< [rad/s per N m]
  double time_constant_ = 0;     ///< [s]
};

/// What an instrument rounds is off by the same for as long as the reading stands: no mean takes that away, as it does
/// noise, which lets no reading stand for long.
std::vector<EqualReadings> rounded(const Observation& o, const NoiseFloor& floor) {
  constexpr std::size_t stands = 16;  // readings
  if (floor.from != FloorSource::resolution && floor.from != FloorSource::counts) return {};
  std::vector<EqualReadings> all = equal_readings(o.value);
  std::erase_if(all, [](const EqualReadings& same) { return same.length() < stands; });
  return all;
}

/// The noise of what drives a model, with what is rounded off it.
void widen_by_rounding(InputNoise& left, const Record& record, Signal signal) {
  const Observation* o = record.find(signal);
  if (o == nullptr || o->rounded.empty() || left.sigma.empty()) return;
  const SharedColumn<double>& t = record.excitation.t;
  for (const EqualReadings& same : o->rounded) {
    const std::size_t first = o->first[same.begin], last = same.end < o->size() ? o->first[same.end] : t.size() - 1;
    left.sigma.widen(first, last, o->sigma[same.begin]);
    left.correlated.widen(first, last, t[last] - t[first]);
  }
}

/// Where the angle is the integral of a speed: what noise makes it wander, and how far a simulated rotor trusts it.
void trust_the_angle(Record& record, const Noise& noise) {
  constexpr double longest_memory = 0.99;  // of the noise, from one reading to the next
  constexpr double more = 4;               // also what rounds the reading, and what lags
  constexpr double window = 0.1;           // [s] over which a shaft turns or stands
  constexpr double clear = 4;              // standard deviations of noise above which it turns
  constexpr double back = 4;  // [1/rad] a rotor that turns is back at a measured angle within a part of a turn
  Excitation& x = record.excitation;
  const Observation* speed = record.find(Signal::omega);
  if (!x.angle_integrated || speed == nullptr || speed->size() < 2) return;
  const double interval = record.interval_of(*speed);
  const NoiseFloor& floor = noise.at(Signal::omega);
  const double rho = std::clamp(floor.autocorrelation, 0.0, longest_memory);
  const double by_noise = floor.sigma * floor.sigma * interval * (1 + rho) / (1 - rho);  // [rad^2/s]
  record.angle_wander = more * by_noise;
  const std::size_t n = x.t.size();
  const auto half =
      static_cast<std::size_t>(std::lround(0.5 * window * static_cast<double>(n - 1) / (x.t.back() - x.t.front())));
  std::vector<double> pull(n, 0.0);
  for (std::size_t k = 0; k < n; ++k) {
    const std::size_t from = k - std::min(k, half), to = std::min(k + half, n - 1);
    const double seconds = x.t[to] - x.t[from];
    if (seconds <= 0) continue;
    const double turning = std::abs(x.angle[to] - x.angle[from]) / seconds;
    pull[k] = back * std::max(0.0, turning - clear * std::sqrt(by_noise / seconds));
  }
  x.angle_pull = std::move(pull);
}

/// Of the change from row to row: when within its row a voltage is read is not known, with an even chance.
constexpr double by_timing = 0.29;

/// [V] By how much a voltage changes around grid point k: half a sample of timing error on an edge looks like an output
/// resistance, a delay or a lag.
double change_around(std::span<const double> e, std::size_t k) {
  const std::size_t before = k > 0 ? k - 1 : k, after = std::min(k + 1, e.size() - 1);
  return std::max(std::abs(e[after] - e[k]), std::abs(e[k] - e[before]));
}

/// A torque that changes from one reading to the next by so many sigma jumps: a brake lets go, or the shaft stops. When
/// is known to a reading only, as at an edge of the voltage.
constexpr double jump = 6;

}  // namespace

Record weighed(ObservedRun run, const Noise& noise, const Model& model) {
  Record record{std::move(run)};
  trust_the_angle(record, noise);
  for (Observation& o : record.observations) {
    o.sigma.assign(o.size(), noise.at(o.signal).sigma);
    o.rounded = rounded(o, noise.at(o.signal));
  }
  widen_by_rounding(record.voltage_noise, record, Signal::e_a);
  widen_by_rounding(record.load_noise, record, Signal::torque);
  const std::vector<double> values = model.values();
  const CarriedNoise carried(record, values, model.input == Signal::i_a);
  const std::vector<double>& t = record.excitation.t;
  const bool begins_with_a_reference = !record.excitation.u_ref.empty();
  const std::vector<double> driver =
      begins_with_a_reference ? driver_voltage(model, values, record.excitation) : std::vector<double>{};
  for (Observation& o : record.observations) {
    const NoiseFloor& floor = noise.at(o.signal);
    o.autocorrelation = floor.autocorrelation;
    std::vector<double> sigma(o.size());
    for (std::size_t i = 0; i < o.size(); ++i) {
      double widened =
          floor.from == FloorSource::counts && !o.counted.empty() ? o.counted[i] : floor.sigma * floor.sigma;
      const std::size_t k = o.last[i];
      if (o.signal == Signal::e_a && !driver.empty()) {
        const double change = by_timing * change_around(driver, k);
        widened += change * change;
      }
      if (o.signal == Signal::torque && !record.excitation.load.empty()) {
        const double change = change_around(record.excitation.load, k);
        if (change > jump * floor.sigma) widened += change * change;
      }
      const std::size_t middle = (o.first[i] + o.last[i]) / 2;
      if (o.functional != Functional::increment) {
        widened += carried.variance(o.signal, middle, t[k] - t[o.first[i]]);
      }
      sigma[i] = std::sqrt(widened);
    }
    o.sigma = ErrorColumn(sigma);
  }
  return record;
}

}  // namespace emtb
