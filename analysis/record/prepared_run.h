#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "hal/signal.h"
#include "model/model.h"
#include "model/simulation.h"
#include "session/session.h"

namespace emtb {

/// What one instrument read of one signal during a run, in the terms of the simulation.
///
/// A reading is the mean of the simulated signal from grid point `first` to grid point `last` (trapezoidal; an instant
/// where both are one): a slow averaging meter is part of the model of the measurement, never interpolated.
struct Observation {
  Signal signal{};
  std::vector<std::uint32_t> first, last;
  std::vector<double> value;  ///< SI
  std::vector<double> sigma;  ///< what the reading may differ from a perfect model: noise, timing, noise of the input;
                              ///< set by weigh() and then the same for all models that are compared
  double lsb = 0;
  bool slow = false;       ///< fewer than half as many readings as the grid has points
  bool increment = false;  ///< the reading is by how much the signal grew from `first` to `last`: an encoder's angle

  std::size_t size() const { return value.size(); }

  /// The simulated reading, from the simulated signal on the grid.
  template <class Get>
  double predicted(std::size_t i, const Get& simulated) const {
    const std::size_t a = first[i], b = last[i];
    if (increment) return simulated(b) - simulated(a);
    if (a == b) return simulated(a);
    double sum = 0.5 * (simulated(a) + simulated(b));
    for (std::size_t k = a + 1; k < b; ++k) sum += simulated(k);
    return sum / static_cast<double>(b - a);
  }
};

/// What the noise of a measured input leaves in it at each grid point, after smoothing.
struct InputNoise {
  std::vector<double> sigma;       ///< in the unit of the input; empty: none
  std::vector<double> correlated;  ///< [s] over which it stays about the same: the integral of its autocorrelation
};

/// A run, prepared for a model: what drives the simulation, stage by stage, and what it is compared with.
///
/// Each unit is driven by what was measured upstream, so that an error stays where it arises: the driver by u_ref, the
/// motor by the measured e_a, the shaft by the measured torque. `chained` drives the motor with the simulated driver
/// instead. Effects that repeat with the angle see the measured one: that of an encoder, or the integral of the
/// measured speed. A simulated one would drift off by turns.
struct PreparedRun {
  std::string name;
  Excitation excitation;
  bool measured_voltage = false;
  bool measured_load = false;
  InputNoise voltage_noise;  ///< [V] of the measured e_a
  InputNoise load_noise;     ///< [N m] of the measured torque
  double angle_wander = 0;   ///< [rad^2/s] variance that an integrated angle gains; set by weigh()
  std::vector<Observation> observations;

  std::size_t length() const { return excitation.t.size(); }

  /// The model's equations as this record drives them.
  ModelStructure structure(const Model& model) const;
};

enum class Chaining { staged, chained };

/// @throws ModelError where the run lacks the model's input, or holds nothing to compare with.
PreparedRun prepare_run(const Run& run, const Model& model, Chaining chaining = Chaining::staged);

/// The same of a run that is one of several.
/// @param order of the shaft with which their speeds repeat, see ripple_order(); absent: none
PreparedRun prepare_run(const Run& run, const Model& model, Chaining chaining, std::optional<double> order);

/// The angular velocity from an encoder's angle: slope of a least-squares line over +-`half` samples, one value every
/// `half`. Where a run has theta and no omega, prepare_run() compares with this.
Series speed_from_angle(const Series& theta, std::size_t half);

}  // namespace emtb
