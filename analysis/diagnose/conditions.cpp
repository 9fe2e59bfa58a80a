#include "analysis/diagnose/conditions.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "analysis/fit/residuals.h"
#include "analysis/numerics/parallel.h"
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

/// What a machine does in a record, at its grid points.
struct Motion {
  std::vector<double> omega, i_a;
  std::vector<double> theta;  ///< empty: the measured angle counts
  std::vector<double> heat;   ///< [J] lost in the armature since the beginning
};

Motion motion_of(const Record& record, const Model& machine) {
  struct Keep final : Reader<double> {
    Motion motion;
    bool angle = false;
    void read(std::size_t, const SimulatedReadings<double>& y) override {
      motion.omega.push_back(y.omega);
      motion.i_a.push_back(y.i_a);
      if (angle) motion.theta.push_back(y.theta);
    }
  } keep;
  const Excitation& x = record.excitation;
  const std::vector<double> values = machine.values();
  keep.angle = x.angle.empty();
  keep.motion.omega.reserve(x.t.size());
  keep.motion.i_a.reserve(x.t.size());
  simulate<double>(record.structure(machine), values, x, keep);
  Motion motion = std::move(keep.motion);
  motion.heat.assign(x.t.size(), 0.0);
  for (std::size_t k = 1; k < motion.heat.size(); ++k) {
    motion.heat[k] = motion.heat[k - 1] + values[base::R_a] * motion.i_a[k] * motion.i_a[k] * (x.t[k] - x.t[k - 1]);
  }
  return motion;
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
                  const Motion& y, const Pieces& pieces, std::size_t stride) {
  const Excitation& x = record.excitation;
  const std::span<const double> angle = x.angle.empty() ? std::span<const double>(y.theta) : x.angle;
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
    put(Condition::heat, y.heat[k]);
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

void visit_readings_by_condition(const RecordRefs& records, const Model& model, const PieceOf& piece_of,
                                 const VisitReadingsByCondition& visit) {
  const std::vector<double> values = model.values();
  // The conditions are those of the machine, not what its instruments make of them.
  const Model machine = without_sensors(model);
  std::vector<Motion> motions(records.size());
  std::vector<std::vector<Residuals>> left(records.size());
  parallel_for(
      records.size(),
      [&](std::size_t i) {
        const Record& record = records[i];
        motions[i] = motion_of(record, machine);
        left[i] = residuals({&record, 1}, 0, record.structure(model), values, {});
      },
      [&](std::size_t i) { return records[i].get().length(); });
  for (const auto& [signal, stride] : strides_of(records)) {
    ReadingsByCondition readings;
    Pieces pieces{piece_of(signal), 0, 0};
    for (std::size_t i = 0; i < records.size(); ++i) {
      const Record& record = records[i];
      pieces.begin = record.excitation.t.front();
      for (std::size_t s = 0; s < left[i].size(); ++s) {
        const Observation& o = record.observations[s];
        if (o.signal == signal) add_readings(readings, record, o, left[i][s], motions[i], pieces, stride);
      }
      pieces.first = pieces.at(record.excitation.t.back()) + 1;
    }
    visit(signal, readings);
  }
}

}  // namespace emtb
