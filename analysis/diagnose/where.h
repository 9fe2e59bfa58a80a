#pragma once

#include <cstddef>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/fit/residuals.h"
#include "analysis/record/record.h"
#include "hal/signal.h"

namespace emtb {

/// What residuals are held against.
enum class Condition { acceleration, angle, heat, current, speed, direction, time, reference };
inline constexpr std::size_t condition_count = 8;
std::string_view name_of(Condition condition) noexcept;  ///< as in JSON: `omega`
std::string_view unit_of(Condition condition) noexcept;

/// How a signal's residual depends on one condition: where the model fails.
struct ResidualMap {
  Signal signal{};
  Condition against{};
  std::vector<double> bins;   ///< middle of each bin, in the condition's unit
  std::vector<double> mean;   ///< mean of measured - simulated, in the signal's unit
  std::vector<double> rmse;   ///< in the signal's unit
  std::vector<double> ratio;  ///< RMSE in multiples of the noise floor
  std::vector<double> count;
  double explained = 0;  ///< share of the residual's variance that the bins' means explain
};

/// A part of each run, as shares of its readings.
struct Part {
  double from = 0, to = 1;
};

/// Residual maps of every signal against every condition, pooled over all records; conditions are the model's own
/// simulation, which is free of noise: the angle within a turn [rad], the heat lost in R_a since the run began [J]. The
/// most telling map of each signal first; none that would be empty, of a meter with a handful of readings.
std::vector<ResidualMap> residual_maps(std::span<const Record> records, const Model& model, Part part = {});

}  // namespace emtb
