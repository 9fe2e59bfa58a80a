#include "analysis/diagnose/conditions.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "analysis/fit/residuals.h"
#include "model/catalogue.h"
#include "model/simulation.h"

namespace emtb {
namespace {

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

double mean_over(const std::vector<double>& x, std::size_t first, std::size_t last) {
  double sum = 0;
  for (std::size_t k = first; k <= last; ++k) sum += x[k];
  return sum / static_cast<double>(last - first + 1);
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

/// Numbers the pieces of a run on from those before it.
struct Pieces {
  double length = 0;  ///< [s]; 0: the run is one
  std::size_t first = 0;
  double begin = 0;  ///< [s]

  std::size_t at(double t) const {
    return first + (length > 0 ? static_cast<std::size_t>(std::max(0.0, (t - begin) / length)) : 0);
  }
};

/// Of each signal, how many readings to go on by so that no more than enough are held.
std::map<Signal, std::size_t> strides_of(const RecordRefs& records) {
  constexpr std::size_t enough = 1U << 18U;
  std::map<Signal, std::size_t> counts;
  for (const Record& record : records) {
    for (const Observation& o : record.observations) counts[o.signal] += o.size();
  }
  for (auto& [signal, count] : counts) count = (count + enough - 1) / enough;
  return counts;
}

/// Adds each so many-th reading of one observation, with the conditions that it was taken in.
void add_readings(ReadingsByCondition& readings, const Record& record, const Observation& o, const Residuals& residuals,
                  const Trajectory<double>& y, std::span<const double> heat, const Pieces& pieces, std::size_t stride) {
  const Excitation& x = record.excitation;
  const std::vector<double>& angle = x.angle.empty() ? y.theta : x.angle;
  for (std::size_t j = 0; j < o.size(); j += stride) {
    const std::size_t a = o.first[j], k = o.last[j];
    const auto over = [&](const std::vector<double>& signal) { return mean_over(signal, a, k); };
    const double scaled = residuals.value[static_cast<Eigen::Index>(j)];
    const auto put = [&](Condition against, double condition) {
      readings[static_cast<std::size_t>(against)].push_back(
          {condition, scaled * o.sigma[j], scaled, pieces.at(x.t[k])});
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

Bins::Bins(std::span<const ConditionedReading> readings) {
  const auto [low, high] = std::ranges::minmax(readings, {}, &ConditionedReading::condition);
  from_ = low.condition;
  width_ = (high.condition - low.condition) / count;
}

std::size_t Bins::of(double condition) const {
  return width_ > 0 ? std::min(count - 1, static_cast<std::size_t>((condition - from_) / width_)) : 0;
}

std::map<Signal, ReadingsByCondition> readings_by_condition(const RecordRefs& records, const Model& model,
                                                            double piece) {
  std::map<Signal, ReadingsByCondition> readings;
  const std::vector<double> values = model.values();
  // The conditions are those of the machine, not what its instruments make of them.
  const Model machine = without_sensors(model);
  const std::vector<double> machine_values = machine.values();
  const std::map<Signal, std::size_t> strides = strides_of(records);
  Pieces pieces{piece, 0, 0};
  for (const Record& record : records) {
    Trajectory<double> y;
    simulate<double>(record.structure(machine), machine_values, record.excitation, y);
    const std::vector<double> heat = heat_of(record.excitation, y.i_a, machine_values[base::R_a]);
    const std::vector<Residuals> rs = residuals({&record, 1}, 0, record.structure(model), values, {});
    pieces.begin = record.excitation.t.front();
    for (std::size_t s = 0; s < rs.size(); ++s) {
      const Observation& o = record.observations[s];
      add_readings(readings[o.signal], record, o, rs[s], y, heat, pieces, strides.at(o.signal));
    }
    pieces.first = pieces.at(record.excitation.t.back()) + 1;
  }
  return readings;
}

}  // namespace emtb
