#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "analysis/live/history.h"
#include "analysis/live/plan.h"
#include "analysis/numerics/first_value.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// The motor as the model has it, from tick to tick of a history, with derivatives by all that moves: as many machines
/// side by side as these need, alike but for their derivatives.
class SimulatedMotor {
 public:
  static constexpr std::size_t lanes = 2 * derivatives_per_pass;  ///< derivatives that one machine carries

  /// @param plan is kept
  explicit SimulatedMotor(const LivePlan& plan);
  SimulatedMotor(const SimulatedMotor&) = delete;  // the machines look into its parameters
  SimulatedMotor& operator=(const SimulatedMotor&) = delete;

  /// Goes on with other parameters, from the present state. @param values all parameters of the structure
  void follow(std::span<const double> values);

  /// As new: all that has a memory has forgotten it.
  void renew();

  /// A run begins with the first of these ticks; the others tell the speed at which it does.
  void start_run(std::span<const LiveTick> ahead);

  /// Goes on from the state in which others were. @param machines none: the first tick begins a run
  void resume(const std::vector<Machine<WideSensitive>>& machines, std::span<const LiveTick> ahead);

  /// To the first of these ticks, across a hole in the readings; the others tell the speed behind it.
  void bridge_gap(std::span<const LiveTick> ahead);

  /// To the next tick.
  void step_to(const LiveTick& now);

  /// Side by side, for all derivatives.
  std::size_t machine_count() const { return p_.size(); }

  /// So many of the ticks from the newest one on are to be handed to it.
  std::size_t look_ahead() const;

  const std::vector<double>& values() const { return values_; }
  const std::vector<Machine<WideSensitive>>& machines() const { return machines_; }
  double t() const { return before_.t; }
  /// Its states are right: what was wrong at the start is forgotten.
  bool settled() const { return before_.t >= valid_from_; }

  double reading(Signal signal) const { return machines_[0].readings().of(signal).v; }
  double derivative(Signal signal, std::size_t j) const {
    return machines_[j / lanes].readings().of(signal).d[j % lanes];
  }

 private:
  void measure_voltage(const LiveTick& now);
  double lsb_of(Signal signal) const;
  std::optional<FirstValue> first_value_of(std::span<const LiveTick> ahead, Signal signal) const;
  /// [rad/s] With which the readings begin; none: at rest.
  std::optional<double> first_speed(std::span<const LiveTick> ahead) const;
  /// Is the driver read to stand elsewhere than where it would be settled, as the machines have it? Then there.
  bool begins_elsewhere(std::span<const LiveTick> ahead, InitialState& initial) const;

  const LivePlan& plan_;
  std::vector<double> values_;
  std::vector<std::vector<WideSensitive>> p_;  ///< for each machine: derivatives of its own
  std::vector<Machine<WideSensitive>> machines_;
  LiveTick before_;
  double e_a_ = 0;              ///< [V] across the motor, the last that was known
  std::size_t unmeasured_ = 0;  ///< ticks since
  double valid_from_ = 0;       ///< [s] from then on the simulated states are right
};

}  // namespace emtb
