#include "analysis/diagnose/compare.h"

#include <algorithm>
#include <cmath>

#include "analysis/diagnose/likelihood.h"
#include "analysis/diagnose/load_law.h"
#include "analysis/fit/residuals.h"
#include "analysis/fit/timing.h"
#include "hal/error.h"
#include "model/simulation.h"

namespace emtb {

std::string_view name_of(Unit unit) noexcept {
  switch (unit) {
    case Unit::driver:
      return "driver";
    case Unit::motor:
      return "motor";
    case Unit::load:
      return "load";
  }
  return "motor";
}

namespace {

/// What drives the motor of a model on records, root mean square.
struct Applied {
  double torque = 0;   ///< [N m]
  double voltage = 0;  ///< [V]
};

Applied applied_on(std::span<const Record> records, const Model& model) {
  const std::vector<double> values = model.values();
  double currents = 0, voltages = 0, n = 0;
  for (const Record& record : records) {
    Trajectory<double> y;
    simulate<double>(record.structure(model), values, record.excitation, y);
    const SharedColumn<double>& given = record.excitation.e_a;
    const std::span<const double> e_a = given.empty() ? std::span<const double>(y.e_a) : given;
    for (const double i : y.i_a) currents += i * i;
    for (const double e : e_a) voltages += e * e;
    n += static_cast<double>(y.i_a.size());
  }
  return {values[base::K_m] * std::sqrt(currents / std::max(1.0, n)), std::sqrt(voltages / std::max(1.0, n))};
}

/// The torque that puts the speed off, or the voltage that puts the current off.
void put_like(Rest& rest, Signal signal, const Model& model, const Applied& applied) {
  const std::vector<double> values = model.values();
  if (signal == Signal::i_a) {
    rest.like = values[base::R_a] * rest.rms;
    rest.applied = applied.voltage;
  } else if (signal == Signal::omega && rest.lasts > 0) {
    const double counter = model.input == Signal::i_a ? 0 : values[base::K_b] * values[base::K_m] / values[base::R_a];
    const double memory = rest.lasts / 2;
    rest.like = std::hypot(values[base::B] + counter, values[base::J] / memory) * rest.rms;
    rest.applied = applied.torque;
  }
}

/// [s] The shortest of all records.
double interval_between_readings(std::span<const Record> records, Signal signal) {
  double shortest = infinity;
  for (const Record& record : records) {
    const Observation* o = record.find(signal);
    if (o != nullptr && o->size() > 1) shortest = std::min(shortest, record.interval_of(*o));
  }
  return shortest;
}

/// Adds what is left of each signal beyond its instrument.
void add_rests(std::map<Signal, SignalFit>& fits, std::span<const Record> records, std::span<const Residuals> residuals,
               const Model& model) {
  const auto beyond = [](const SignalFit& fit) {
    const double excess = fit.ratio * fit.ratio - 1;
    return fit.ratio > above_the_floor && excess > 2 * fit.noise.relative_error;
  };
  if (std::ranges::none_of(fits, [&](const auto& entry) { return beyond(entry.second); })) return;
  const Applied applied = applied_on(records, model);
  const ResidualSpectra spectra = spectra_of(records, residuals);
  for (auto& [signal, fit] : fits) {
    if (!beyond(fit)) continue;
    fit.rest.rms = fit.rmse * std::sqrt(1 - 1 / (fit.ratio * fit.ratio));
    if (const auto spectrum = spectra.find(signal); spectrum != spectra.end()) {
      fit.rest.lasts = 2 * spectrum->second.fitted().time;
    }
    fit.rest.hops = fit.rest.lasts > 0 && fit.rest.lasts < interval_between_readings(records, signal);
    if (fit.rest.hops) {
      fit.rest.lasts = 0;
    } else {
      put_like(fit.rest, signal, model, applied);
    }
  }
}

}  // namespace

std::map<Signal, SignalFit> fit_of(std::span<const Record> records, const Model& model, const Noise& noise) {
  struct Sums {
    double squares = 0, scaled = 0, value = 0, value_squares = 0, count = 0;
  };
  std::map<Signal, Sums> sums;
  const std::vector<Residuals> left = residuals(records, model, model.values(), {});
  for (const Residuals& r : left) {
    const Observation& o = *records[r.record].find(r.signal);
    Sums& s = sums[r.signal];
    for (std::size_t i = 0; i < o.size(); ++i) {
      const double scaled = r.value[static_cast<Eigen::Index>(i)];
      s.squares += std::pow(scaled * o.sigma[i], 2);
      s.scaled += scaled * scaled;
      s.value += o.value[i];
      s.value_squares += o.value[i] * o.value[i];
      s.count += 1;
    }
  }
  std::map<Signal, SignalFit> fits;
  for (const auto& [signal, s] : sums) {
    const double spread = s.value_squares - s.value * s.value / s.count;
    fits[signal] = {noise.at(signal), std::sqrt(s.squares / s.count), std::sqrt(s.scaled / s.count),
                    spread > 0 ? 100 * (1 - std::sqrt(s.squares / spread)) : 0};
    const double floor = noise.at(signal).sigma;
    fits[signal].moves = spread / s.count > 2 * floor * floor;  // half of the scatter is then its own
  }
  add_rests(fits, records, left, model);
  return fits;
}

Comparison compare(std::span<const Run> runs, const Model& model, const Model& judge, std::span<const Run> beside) {
  if (model.input != judge.input) {
    throw ModelError("models `" + judge.name + "` and `" + model.name + "` are driven by different inputs, " +
                     std::string(info(judge.input).name) + " and " + std::string(info(model.input).name) +
                     ": their errors cannot be compared");
  }
  Comparison result;
  const bool alone = beside.empty();
  Dataset staged = alone ? prepare(runs, {}, judge) : prepare(beside, runs, judge);
  settle_as_it_stands(staged, model);
  result.timing = staged.timing;
  result.interval = staged.interval();
  const std::vector<Record>& compared = alone ? staged.train : staged.held_out;
  const auto staged_squares = mean_squares(residuals(compared, model, model.values(), {}));
  result.error = error_of(staged_squares);
  result.signals = fit_of(compared, model, staged.noise);
  std::vector<Record> chained = prepare_with(staged.noise, runs, judge, Chaining::chained, staged.ripple_order);
  set_timing(chained, staged.timing);
  for (std::size_t i = 0; i < chained.size(); ++i) chained[i].excitation.initial = compared[i].excitation.initial;
  const auto chained_squares = mean_squares(residuals(chained, model, model.values(), {}));
  result.chained_error = error_of(chained_squares);
  for (const auto& [signal, square] : chained_squares) result.chained[signal] = std::sqrt(square);
  double worst = above_the_floor;
  for (const auto& [signal, square] : staged_squares) {
    if (std::sqrt(square) <= worst) continue;
    worst = std::sqrt(square);
    result.failing_unit = signal == Signal::e_a ? Unit::driver : signal == Signal::torque ? Unit::load : Unit::motor;
  }
  result.where = residual_maps(compared, model);
  return result;
}

double error_on(std::span<const Record> records, const Model& model, const Model& alike) {
  if (records.empty()) return std::nan("");
  std::map<Signal, double> squares = mean_squares(residuals(records, model, model.values(), {}));
  if (squares.size() > 1 && torque_only_loads(records, alike)) squares.erase(Signal::torque);
  return error_of(squares);
}

}  // namespace emtb
