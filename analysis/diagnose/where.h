#pragma once

#include <span>
#include <vector>

#include "analysis/diagnose/conditions.h"
#include "analysis/record/record.h"
#include "hal/signal.h"
#include "model/model.h"

namespace emtb {

/// How a signal's residual depends on one condition: where the model fails.
struct ResidualMap {
  Signal signal{};
  Condition against{};
  std::vector<double> bins = {};   ///< middle of each bin, in the condition's unit
  std::vector<double> mean = {};   ///< mean of measured - simulated, in the signal's unit
  std::vector<double> rmse = {};   ///< in the signal's unit
  std::vector<double> ratio = {};  ///< RMSE in multiples of the noise floor
  std::vector<double> count = {};
  std::vector<double> std_error = {};  ///< of the mean, in the signal's unit: readings near each other count as one
  double explained = 0;                ///< share of the residual's variance that the bins' means explain
};

/// Residual maps of every signal against every condition, pooled over all records; conditions are the model's own
/// simulation, which is free of noise: the angle within a turn [rad], the heat lost in R_a since the run began [J]. The
/// most telling map of each signal first; none that would be empty, of a meter with a handful of readings.
std::vector<ResidualMap> residual_maps(const RecordRefs& records, const Model& model);
std::vector<ResidualMap> residual_maps(std::span<const Record> records, const Model& model);

}  // namespace emtb
