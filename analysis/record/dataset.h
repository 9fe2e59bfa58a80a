#pragma once

#include <map>
#include <optional>
#include <span>
#include <vector>

#include "analysis/record/noise_floor.h"
#include "analysis/record/record.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// When what is set from outside acts, relative to the readings of its row, before they are taken or after; and which
/// instruments are read behind the others.
struct Timing {
  double acts_after = 0;  ///< [s] a sample at most; negative: the readings of a row were taken after it was written
  bool held = false;      ///< a voltage that is the model's input was set, and holds from row to row
  std::size_t rows_early = 0;  ///< by which it acts before that: it was written so many rows behind
  int voltage_late = 0;        ///< [rows] by which the reading of the terminals is behind; taken out of the runs
  std::map<Signal, double> late = {};  ///< [samples] see Observation::late; of those not in it, 0, but of the terminals
                                       ///< what their runs told (terminals_are_late())
  bool lags_in_itself = false;         ///< see Record
  bool meters_at_once = false;         ///< slow meters read the signal as it is (Observation::at_once)

  bool operator==(const Timing&) const = default;
};

/// May the readings of an instrument be instants as well as means? Those of a slow meter of which nobody said what they
/// are.
bool may_read_at_once(const Observation& o);

/// Runs as weighed records that share one noise floor: the one way from a session to what a model is compared with.
struct Dataset {
  std::vector<Record> train, held_out;
  Noise noise;
  std::optional<double> ripple_order = {};  ///< [1/turn] with which the speeds of the training runs repeat
  Timing timing = {};                       ///< of all runs, see fit/timing.h
  std::shared_ptr<Effort> effort = {};      ///< of all that was simulated of them

  RecordRefs all() const;   ///< as long as the dataset stands
  double interval() const;  ///< [s] of a sample of the first training run
};

void set_timing(std::span<Record> records, const Timing& timing);
void set_timing(Dataset& data, const Timing& timing);

/// Weighs all records anew.
void set_noise(Dataset& data, Noise noise, const Model& model);

/// Simulates all records in steps for the motor that a model was fitted to, where its time constant is clearly another
/// than that of the model which they were prepared for: too long ones simulate it wrongly, too short ones for nothing.
/// @return whether that changes any
bool set_steps(Dataset& data, const Model& fitted);

/// The same, but only where they have to be shorter: what was fitted in steps that are too long for it is not its own.
bool set_shorter_steps(Dataset& data, const Model& fitted);

/// Prepares runs for a model. Weights depend on the data and the model as given, and stay fixed from here on.
/// @throws ModelError where a run does not fit the model.
Dataset prepare(std::span<const Run> train, std::span<const Run> held_out, const Model& model,
                Chaining chaining = Chaining::staged);

/// The same of runs whose noise is known: of further runs beside a dataset, or of a run that was never made.
/// @param order see Dataset::ripple_order; without this parameter each run is looked at by itself
std::vector<Record> prepare_with(const Noise& noise, std::span<const Run> runs, const Model& model, Chaining chaining,
                                 std::optional<double> order);
Record prepare_with(const Noise& noise, const Run& run, const Model& model, Chaining chaining = Chaining::staged);

}  // namespace emtb
