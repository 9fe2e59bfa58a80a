#include "analysis/record/noise_floor.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/parallel.h"
#include "analysis/numerics/regression.h"
#include "analysis/numerics/scatter.h"
#include "analysis/numerics/statistics.h"
#include "analysis/record/settled_pieces.h"

namespace emtb {
namespace {

/// Third differences, pooled over runs. They are a bound on either side: coloured noise makes them too small; readings
/// so far apart that the signal bends between them too large, which differences of a higher order tell by falling on.
/// Infinite where no run holds enough readings to tell.
NoiseFloor floor_by_differences(std::span<const Observation* const> observed) {
  constexpr std::size_t usual = 3, higher = 5, fewest = 4;
  constexpr double still_falls = 0.7;  // noise alone leaves all orders alike
  std::vector<double> third, fifth;
  for (const Observation* o : observed) {
    if (o->size() < higher + fewest) continue;
    third.push_back(scatter_of_differences(o->value, usual));
    fifth.push_back(scatter_of_differences(o->value, higher));
  }
  NoiseFloor floor;
  floor.from = FloorSource::differences;
  floor.sigma = third.empty() ? infinity : median(std::move(third));
  floor.upper_bound = !fifth.empty() && median(std::move(fifth)) < still_falls * floor.sigma;
  floor.lower_bound = !floor.upper_bound;
  return floor;
}

NoiseFloor floor_by_differences(std::span<const Observation> observed) {
  std::vector<const Observation*> all;
  for (const Observation& o : observed) all.push_back(&o);
  return floor_by_differences(std::span<const Observation* const>(all));
}

/// The values of a signal over each time in which the input is other than nothing.
std::vector<Observation> while_driven(std::span<const ObservedRun> records, Signal signal) {
  std::vector<Observation> stretches;
  for (const ObservedRun& record : records) {
    const Observation* o = record.find(signal);
    if (o == nullptr) continue;
    bool driven = false;
    for (std::size_t i = 0; i < o->size(); ++i) {
      const bool was_driven = std::exchange(driven, input_of(record.excitation)[o->last[i]] != 0);
      if (!driven) continue;
      if (!was_driven) stretches.emplace_back();
      stretches.back().value.push_back(o->value[i]);
    }
  }
  return stretches;
}

/// The floor, or that of the readings while something is driven, where these are clearly louder.
NoiseFloor louder_while_driven(const NoiseFloor& floor, std::span<const ObservedRun> records, Signal signal) {
  const NoiseFloor driven = floor_by_differences(while_driven(records, signal));
  return driven.sigma < infinity && driven.sigma > clearly_louder * floor.sigma ? driven : floor;
}

/// How much a signal varies over all its readings [SI].
double variation_of(std::span<const Observation* const> observed) {
  double n = 0, sum = 0, squares = 0;
  for (const Observation* o : observed) {
    for (const double v : o->value) n += 1, sum += v, squares += v * v;
  }
  return n > 0 ? std::sqrt(std::max(0.0, squares / n - sum * sum / (n * n))) : 0;
}

/// How far apart its readings lie at most [SI].
double range_of(std::span<const Observation* const> observed) {
  double low = infinity, high = -infinity;
  for (const Observation* o : observed) {
    for (const double v : o->value) low = std::min(low, v), high = std::max(high, v);
  }
  return std::max(0.0, high - low);
}

/// What whole counts of an encoder leave in the readings of a signal, where all of its runs know the encoder's step.
std::optional<NoiseFloor> floor_of_counts(std::span<const Observation* const> observed) {
  double squares = 0, n = 0, correlation = 0;
  for (const Observation* o : observed) {
    if (o->counted.empty()) return std::nullopt;
    for (const double variance : o->counted) squares += variance;
    n += static_cast<double>(o->size());
    correlation += o->counted_correlation * static_cast<double>(o->size());
  }
  if (n == 0) return std::nullopt;
  NoiseFloor floor;
  floor.sigma = std::sqrt(squares / n);
  floor.from = FloorSource::counts;
  floor.autocorrelation = correlation / n;
  return floor;
}

/// The relative standard error of a standard deviation that was pooled from pieces, by how they scatter.
double relative_error_of(std::span<const double> variances) {
  if (variances.size() < 2) return 1;
  double mean = 0, squares = 0;
  const auto n = static_cast<double>(variances.size());
  for (const double v : variances) mean += v / n;
  for (const double v : variances) squares += (v - mean) * (v - mean) / (n - 1);
  return mean > 0 ? 0.5 * std::sqrt(squares / n) / mean : 0;
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
/// acceleration, speed, direction, voltage; of few readings by the first two. What no line says counts as noise: an
/// upper bound, for where nothing ever settles for as long as the meter takes. Negative where there are no such
/// signals.
double scatter_about_fast_signals(std::span<const ObservedRun> records, Signal signal) {
  constexpr std::size_t of_few = 3, fewest = 6;
  std::vector<std::vector<double>> columns(5);
  std::vector<double> readings;
  for (const ObservedRun& record : records) {
    const Excitation& x = record.excitation;
    const Observation *slow = record.find(signal), *fast = record.find(Signal::omega);
    if (slow == nullptr || fast == nullptr || fast->slow) continue;
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
      columns[1].push_back(omega[b] - omega[a]);
      columns[2].push_back(speed);
      columns[3].push_back(direction);
      columns[4].push_back(voltage);
      readings.push_back(slow->value[i]);
    }
  }
  if (readings.size() < fewest) return -1;
  if (readings.size() < 4 * columns.size()) columns.resize(of_few);
  const Regression line = regress(columns, readings);
  std::vector<double> left;
  for (std::size_t i = 0; i < readings.size(); ++i) {
    double predicted = 0;
    for (std::size_t c = 0; c < columns.size(); ++c) predicted += line.value[c] * columns[c][i];
    left.push_back(std::abs(readings[i] - predicted));
  }
  const auto n = static_cast<double>(readings.size());
  return robust_sigma(std::move(left)) * std::sqrt(n / (n - static_cast<double>(columns.size())));
}

/// The reference is set, so that it is the same where a run was repeated: to a digit of the card that reads it back.
bool repeats(const ObservedRun& a, const ObservedRun& b) {
  const std::vector<double>&x = a.excitation.u_ref, &y = b.excitation.u_ref;
  const std::size_t n = std::min(x.size(), y.size());
  if (n == 0 || static_cast<double>(n) < 0.98 * static_cast<double>(std::max(x.size(), y.size()))) return false;
  double range = 0;
  for (const double u : x) range = std::max(range, std::abs(u));
  if (range == 0) return false;  // an idle bridge is quieter than one that drives
  std::size_t apart = 0;         // where an edge fell between other readings
  for (std::size_t k = 0; k < n; ++k) apart += std::abs(x[k] - y[k]) > 0.005 * range;
  return 200 * apart <= n;
}

/// Half the scatter of what repeated runs differ by, in pieces of 1 s at most about a straight line each: what drifts
/// from run to run, as a motor that warms, is no noise.
std::vector<EvenLine> scatter_between_repeats(std::span<const ObservedRun> records, Signal signal) {
  std::vector<EvenLine> pieces;
  const auto piece_of = [&](std::vector<double>& differences) {
    if (differences.size() >= 2 * fewest_readings) {
      EvenLine s = even_line(differences);
      s.variance /= 2;
      s.covariance /= 2;
      pieces.push_back(s);
    }
    differences.clear();
  };
  for (std::size_t i = 0; i < records.size(); ++i) {
    const auto next = std::find_if(records.begin() + static_cast<std::ptrdiff_t>(i) + 1, records.end(),
                                   [&](const ObservedRun& other) { return repeats(records[i], other); });
    if (next == records.end()) continue;
    const Observation *one = records[i].find(signal), *other = next->find(signal);
    if (one == nullptr || other == nullptr) continue;
    const std::vector<double>&t = records[i].excitation.t, &u = next->excitation.t;
    const double shortest = settled_stretch(t);
    std::vector<double> differences;
    double begin = t.front();
    for (std::size_t k = 0; k < std::min(one->size(), other->size()); ++k) {
      const double at = t[one->last[k]];
      const double interval = k > 0 ? at - t[one->last[k - 1]] : 0;
      if (k > 0 && std::abs(at - u[other->last[k]]) > 0.5 * interval) break;  // readings that do not go side by side
      differences.push_back(one->value[k] - other->value[k]);
      if (at - begin >= std::max(shortest, 20 * interval)) {
        piece_of(differences);
        begin = at;
      }
    }
    piece_of(differences);
  }
  return pieces;
}

/// A floor that is no lower than how exact a simulation is.
NoiseFloor no_better_than_a_simulation(NoiseFloor floor, std::span<const Observation* const> observed) {
  if (const double least = accuracy_of_a_simulation * variation_of(observed); floor.sigma < least) {
    floor.sigma = least;
    floor.from = FloorSource::accuracy;
    floor.lower_bound = floor.upper_bound = false;
  }
  return floor;
}

bool of_the_circuit(Signal signal) { return signal == Signal::i_a || signal == Signal::e_a; }

/// The settled pieces of a signal, less what is no noise in them.
SettledPieces settled_pieces_of(Signal signal, std::span<const ObservedRun> records) {
  SettledPieces settled;
  bool counts = false;
  for (const ObservedRun& record : records) {
    const Observation* o = record.find(signal);
    if (o == nullptr) continue;
    collect(record, *o, settled);
    counts = counts || o->origin != Origin::instrument;
  }
  if (signal == Signal::omega) leave_out_rest(settled, counts);
  remove_what_repeats(settled);
  if (of_the_circuit(signal)) leave_out_idle(settled);
  return settled;
}

NoiseFloor floor_of(Signal signal, std::span<const ObservedRun> records) {
  std::vector<const Observation*> observed;
  double lsb = 0;
  bool slow = false;
  for (const ObservedRun& record : records) {
    const Observation* o = record.find(signal);
    if (o == nullptr) continue;
    slow = o->slow;
    observed.push_back(o);
    lsb = std::max(lsb, o->lsb);
  }
  if (const auto counts = floor_of_counts(observed)) return no_better_than_a_simulation(*counts, observed);
  NoiseFloor floor;
  const SettledPieces settled = settled_pieces_of(signal, records);
  std::vector<double> variances, correlations;
  const auto take = [&](std::span<const double> piece) {
    const EvenLine s = even_line(piece);
    variances.push_back(s.variance);
    if (s.variance > 0) correlations.push_back(s.covariance / s.variance);
  };
  for (const TurningStretch& piece : settled.fast) take(piece.value);
  for (const auto& piece : settled.slow) take(piece);
  const auto pooled = [&](FloorSource from) {
    floor.sigma = std::sqrt(median(variances));
    floor.from = from;
    floor.relative_error = relative_error_of(variances);
    if (!correlations.empty()) floor.autocorrelation = std::clamp(median(correlations), -0.99, 0.999);
  };
  const auto take_repeats = [&] {
    variances.clear();
    correlations.clear();
    for (const EvenLine& s : scatter_between_repeats(records, signal)) {
      variances.push_back(s.variance);
      if (s.variance > 0) correlations.push_back(s.covariance / s.variance);
    }
    return variances.size() >= 2;
  };
  if (variances.size() >= 2) {
    pooled(FloorSource::settled);
  } else if (const double scatter = scatter_of_neighbours(settled.short_slow); scatter >= 0) {
    floor.sigma = scatter;
    floor.from = FloorSource::settled;
  } else if (take_repeats()) {
    pooled(FloorSource::repeats);
  } else {
    floor = floor_by_differences(observed);
    if (of_the_circuit(signal)) floor = louder_while_driven(floor, records, signal);
  }
  if (slow) {
    // The readings may all span a change, or a relaxation whose last part passes for settled: then their scatter is
    // that of the current itself.
    constexpr double clearly = 0.7;
    const double beside = scatter_about_fast_signals(records, signal);
    if (beside >= 0 && beside < (floor.lower_bound ? 1 : clearly) * floor.sigma) {
      floor = {};
      floor.sigma = beside;
      floor.from = FloorSource::regression;
    }
  }
  const double resolution = lsb / std::sqrt(12.0);
  if (floor.sigma == infinity && resolution == 0) {  // too few readings, of an instrument of which nothing is known
    constexpr double share = 1e-3;
    floor.sigma = share * range_of(observed);
    floor.from = FloorSource::assumed;
  }
  if (floor.sigma < resolution || floor.sigma == infinity) {
    floor.sigma = resolution;
    floor.from = FloorSource::resolution;
    floor.lower_bound = floor.upper_bound = false;
  }
  return no_better_than_a_simulation(floor, observed);
}

}  // namespace

std::string_view name_of(FloorSource source) noexcept {
  switch (source) {
    case FloorSource::declared:
      return "declared";
    case FloorSource::counts:
      return "counts";
    case FloorSource::settled:
      return "settled";
    case FloorSource::repeats:
      return "repeats";
    case FloorSource::regression:
      return "regression";
    case FloorSource::differences:
      return "differences";
    case FloorSource::resolution:
      return "resolution";
    case FloorSource::accuracy:
      return "accuracy";
    case FloorSource::assumed:
      return "assumed";
  }
  return "differences";
}

Noise estimate_noise(std::span<const ObservedRun> records, const Model& model) {
  std::map<Signal, const Observation*> first;
  for (const ObservedRun& record : records) {
    for (const Observation& o : record.observations) first.try_emplace(o.signal, &o);
  }
  const std::vector<std::pair<Signal, const Observation*>> signals(first.begin(), first.end());
  std::vector<NoiseFloor> floors(signals.size());
  parallel_for(signals.size(), [&](std::size_t i) {
    const auto& [signal, o] = signals[i];
    floors[i] = floor_of(signal, records);
    if (const auto declared = model.noise.find(signal); declared != model.noise.end()) {
      floors[i].sigma = std::max(declared->second, o->lsb / std::sqrt(12.0));
      floors[i].from = FloorSource::declared;
      floors[i].lower_bound = floors[i].upper_bound = false;
      floors[i].relative_error = 0;
    }
    if (floors[i].sigma <= 0) floors[i].sigma = 1e-9;  // a signal without any scatter at all: nothing to weigh by
  });
  Noise noise;
  for (std::size_t i = 0; i < signals.size(); ++i) noise[signals[i].first] = floors[i];
  return noise;
}

}  // namespace emtb
