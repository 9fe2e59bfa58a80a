#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "analysis/record/effort.h"
#include "analysis/record/inputs.h"
#include "analysis/record/observation.h"
#include "model/model.h"
#include "model/simulation.h"
#include "session/session.h"

namespace emtb {

/// A run in the terms of a model: what drives the simulation, stage by stage, and what it is compared with.
///
/// Each unit is driven by what was measured upstream, so that an error stays where it arises: the driver by u_ref, the
/// motor by the measured e_a, the shaft by the measured torque. `chained` drives the motor with the simulated driver
/// instead. Effects that repeat with the angle see the measured one: that of an encoder, or the integral of the
/// measured speed. A simulated one would drift off by turns.
struct ObservedRun {
  std::string name;
  Excitation excitation;
  bool measured_voltage = false;
  bool measured_load = false;
  InputNoise voltage_noise;  ///< [V] of the measured e_a
  InputNoise load_noise;     ///< [N m] of the measured torque
  std::vector<Observation> observations;

  std::size_t length() const { return excitation.t.size(); }

  /// The observation of a signal; null where it was not read.
  const Observation* find(Signal signal) const;

  /// [s] from one reading to the next, where there are two or more.
  double interval_of(const Observation& o) const;

  /// The model's equations as this run drives them.
  ModelStructure structure(const Model& model) const;
};

/// A run that is weighed, too: each reading has its sigma. Whole when made (dataset.h), and not changed any more.
struct Record : ObservedRun {
  double angle_wander = 0;              ///< [rad^2/s] variance that an integrated angle gains
  bool lags_in_itself = false;          ///< no timing explains it: what lags by less than a row is the machine
  std::shared_ptr<Effort> effort = {};  ///< of its simulations; null: nobody asks

  void count_simulation(const ModelStructure& simulated, std::size_t derivatives) const {
    if (effort) effort->add(steps_of(simulated, excitation), derivatives);
  }
};

/// Records that need not lie side by side: none is copied, which an hour's would not bear.
using RecordRefs = std::vector<std::reference_wrapper<const Record>>;

/// [s] Sets steps that are short enough for a motor with the time constant of a model.
void set_steps(Excitation& x, const Model& model);

enum class Chaining { staged, chained };

/// What runs that were logged alike tell of how they were.
struct Logging {
  std::optional<double> order = {};  ///< of the shaft with which the speeds repeat, see ripple_order(); absent: none
  double acts_after = 0;             ///< [s] when the reference acts, see reference_acts_after()
  double voltage_late = 0;           ///< [samples] see terminals_are_late()
  AngleNoise angle_noise = {};       ///< of an encoder, beyond its counts
  bool voltage_hops = false;         ///< the input is a noisy reading, see voltage_hops_alone()
};

/// The first step from a run to a record.
/// @throws ModelError where the run lacks the model's input, or holds nothing to compare with.
ObservedRun observe_run(const Run& run, const Model& model, Chaining chaining, const Logging& logging);
/// The same of a run by itself.
ObservedRun observe_run(const Run& run, const Model& model, Chaining chaining = Chaining::staged);

}  // namespace emtb
