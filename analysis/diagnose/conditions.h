#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/record/record.h"
#include "hal/signal.h"
#include "model/model.h"

namespace emtb {

/// What residuals are held against.
enum class Condition { acceleration, angle, heat, current, speed, direction, time, reference };
inline constexpr std::size_t condition_count = 8;
std::string_view name_of(Condition condition) noexcept;  ///< as in JSON: `omega`
std::string_view unit_of(Condition condition) noexcept;

/// One reading with a condition that it was taken in, which is the model's own simulation and so free of noise.
struct ConditionedReading {
  double condition = 0;
  double residual = 0;    ///< measured - simulated, in the signal's unit
  double scaled = 0;      ///< the same, in units of the noise floor
  std::size_t piece = 0;  ///< of all records
};

/// The range of a condition in twelve equal bins.
class Bins {
 public:
  static constexpr std::size_t count = 12;
  explicit Bins(std::span<const ConditionedReading> readings);
  std::size_t of(double condition) const;

 private:
  double from_, width_;
};

/// The readings of a signal by condition; none where the condition is not known of it.
using ReadingsByCondition = std::array<std::vector<ConditionedReading>, condition_count>;

/// Called with a signal, in their order, and its readings, which go when the next signal comes.
using VisitReadingsByCondition = std::function<void(Signal, const ReadingsByCondition&)>;

/// [s] The length of the pieces of a signal that are numbered on through all records; 0: each record is one.
using PieceOf = std::function<double(Signal)>;

/// The readings of all records with their conditions, or of more than a quarter of a million of a signal every second,
/// third ..., which tell as much: the angle within a turn [rad], the heat lost in R_a since the run
/// began [J].
void visit_readings_by_condition(const RecordRefs& records, const Model& model, const PieceOf& piece_of,
                                 const VisitReadingsByCondition& visit);

}  // namespace emtb
