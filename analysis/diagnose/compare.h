#pragma once

#include <map>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/diagnose/where.h"
#include "analysis/record/dataset.h"
#include "analysis/record/noise_floor.h"
#include "analysis/record/record.h"
#include "session/session.h"

namespace emtb {

/// A part of the bench that a model describes.
enum class Unit { driver, motor, load };
std::string_view name_of(Unit unit) noexcept;  ///< as in JSON

/// What a model leaves of a signal beyond its instrument, in the terms of the machine.
struct Rest {
  double rms = 0;     ///< in the signal's unit; 0: the instrument explains all that is left
  double lasts = 0;   ///< [s] over which it counts as one error; 0: not known
  bool hops = false;  ///< it is another in each reading, so that no torque can make it, nor a voltage
  /// Of the speed the torque [N m], of the current the voltage [V] that would put the model off by as much: through the
  /// motor as a lag of first order, at the rate at which the rest changes. 0: not known
  double like = 0;
  double applied = 0;  ///< rms of what the motor is driven by: its own torque, or the voltage
};

/// How well one signal is predicted.
struct SignalFit {
  NoiseFloor noise;
  double rmse = 0;         ///< in the signal's unit
  double ratio = 0;        ///< in multiples of the noise floor
  double fit_percent = 0;  ///< 100 (1 - NRMSE): 100 is perfect, 0 no better than the signal's mean
  Rest rest = {};
  bool moves = true;  ///< varies by more than its instrument scatters: else there is nothing to fit
};

/// A model beside measurements.
struct Comparison {
  double error = 0;          ///< each unit driven by what was measured upstream; 1 = noise floor
  double chained_error = 0;  ///< all units in a row, from the reference alone
  std::map<Signal, SignalFit> signals;
  std::map<Signal, double> chained;  ///< RMSE/sigma of each signal when chained
  std::optional<Unit> failing_unit;  ///< none is above its floor where absent
  std::vector<ResidualMap> where;
  Timing timing;        ///< when inputs act and instruments read, as these runs tell
  double interval = 0;  ///< [s] of a sample of it
};

/// Compares the model as it stands with all runs.
/// @param judge whose start values weigh the readings: models that are held against each other share one judge
/// @param beside runs that the model was fitted to: they tell noise floor and timing, as in the fit
/// @throws ModelError where the judge has another input than the model
Comparison compare(std::span<const Run> runs, const Model& model, const Model& judge, std::span<const Run> beside = {});
inline Comparison compare(std::span<const Run> runs, const Model& model) { return compare(runs, model, model); }

/// The error of a model on records as it stands, 1 = noise floor: of all signals that it predicts, so without a
/// measured torque that only loads it. NaN where there are no records.
/// @param alike the model whose torque counts: the same in two models that are held against each other
double error_on(std::span<const Record> records, const Model& model, const Model& alike);
inline double error_on(std::span<const Record> records, const Model& model) { return error_on(records, model, model); }

/// The fit of each signal on records.
std::map<Signal, SignalFit> fit_of(std::span<const Record> records, const Model& model, const Noise& noise);

}  // namespace emtb
