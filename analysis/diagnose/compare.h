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

/// How well one signal is predicted.
struct SignalFit {
  NoiseFloor noise;
  double rmse = 0;         ///< in the signal's unit
  double ratio = 0;        ///< in multiples of the noise floor
  double fit_percent = 0;  ///< 100 (1 - NRMSE): 100 is perfect, 0 no better than the signal's mean
};

/// A model beside measurements.
struct Comparison {
  double error = 0;          ///< each unit driven by what was measured upstream; 1 = noise floor
  double chained_error = 0;  ///< all units in a row, from the reference alone
  std::map<Signal, SignalFit> signals;
  std::map<Signal, double> chained;  ///< RMSE/sigma of each signal when chained
  std::optional<Unit> failing_unit;  ///< none is above its floor where absent
  std::vector<ResidualMap> where;
};

/// Compares the model as it stands with all runs.
/// @param judge whose start values weigh the readings: models that are held against each other share one judge
/// @throws ModelError where the judge has another input than the model
Comparison compare(std::span<const Run> runs, const Model& model, const Model& judge);
inline Comparison compare(std::span<const Run> runs, const Model& model) { return compare(runs, model, model); }

/// The fit of each signal on records.
std::map<Signal, SignalFit> fit_of(std::span<const Record> records, const Model& model, const Noise& noise);

}  // namespace emtb
