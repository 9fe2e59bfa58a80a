#pragma once

#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "model/catalogue.h"
#include "model/dual.h"
#include "model/effect.h"
#include "model/structure.h"

namespace emtb {

/// What drives one step, from the data or from the stage above.
struct StepInput {
  double u_ref = 0;  ///< [V] held over the step
  double e_a_start =
      0;               ///< [V] terminal voltage, linear over the step; used where the structure says `measured_voltage`
  double e_a_end = 0;  ///< [V]
  double i_a = 0;      ///< [A] of a current drive, held over the step
  double load = 0;     ///< [N m] measured load torque, mean over the step: a passive load
  double omega = 0;    ///< [rad/s] measured speed: predicts the load where `measured_load`
  bool armature_open = false;
};

/// The machine, one step at a time: reference -> driver -> armature circuit -> air gap -> shaft -> load -> sensors.
///
///     e_a     = R_a i + L_a di/dt + K_b φ ω + V                  (1), (3) of Erdal et al. (2011)
///     K_m φ i = J dω/dt + B ω + T_load + T_smooth + T_dry        (4), (5)
///
/// One step h solves both at once, second order, for any L_a >= 0:
///  - the armature circuit exactly, for a voltage that is linear over the step (so L_a -> 0 is neither stiff nor
///  special);
///  - the shaft by the trapezoidal rule; dry friction by an implicit soft threshold, so that the shaft sticks exactly;
///  - what the effects contribute at the extrapolated middle of the step.
///
/// Divisions and the exponential depend on R_a, L_a, K_b, K_m, B, J and h only; they are kept until one of these
/// changes.
template <class Scalar>
class Machine {
 public:
  /// @param p all parameters of the structure, in its order; must outlive the machine
  Machine(const ModelStructure& structure, std::span<const Scalar> p) : structure_(structure), p_(p) {
    std::size_t parameter = ModelStructure::base_count;
    std::size_t memory = 0;
    for (const std::size_t effect : structure.effects) {
      const EffectInfo& info = effect_catalogue()[effect];
      Parts& parts = info.stage == Stage::driver    ? driver_parts_
                     : info.stage == Stage::sensors ? sensor_parts_
                     : info.stage == Stage::load    ? load_parts_
                                                    : motor_parts_;
      parts.push_back({apply_of<Scalar>(effect), parameter, info.parameter_count, memory, info.memory});
      parameter += info.parameter_count;
      memory += info.memory;
      inductive_ |= info.stage == Stage::armature;
    }
    memory_.resize(memory);
    reset_driver_terms();
    reset_motor_terms();
  }

  /// Puts the machine into its state at the start of a run, and takes the first readings.
  void start(const InitialState& initial, const StepInput& input) {
    omega = omega_before_ = Scalar(initial.omega);
    theta = Scalar(initial.theta);
    i_a = i_a_before_ = Scalar(initial.i_a);
    terms_.u = Scalar(input.u_ref);
    apply(driver_parts_, {.u_ref = input.u_ref});
    e_driver = initial.e_driver ? Scalar(*initial.e_driver) : clamped(terms_.gain * terms_.u, terms_.min, terms_.max);
    middle_ = {.u_ref = input.u_ref, .e_a = e_driver, .i_a = i_a, .omega = omega, .theta = theta};
    if (structure_.measured_load) middle_.omega = Scalar(input.omega);
    apply(load_parts_, middle_);
    read_sensors(0, 0, input);
  }

  /// Advances from t to t + h.
  void step(const StepInput& in, double t, double h) {
    if (!structure_.effects.empty()) look_at_middle(in, t, h);

    // Driver: u_ref -> e_a.
    Scalar e0 = e_driver;
    if (structure_.input == Signal::u_ref) follow_reference(in.u_ref, h);
    Scalar e1 = e_driver;
    if (structure_.measured_voltage) {
      e0 = Scalar(in.e_a_start);
      e1 = Scalar(in.e_a_end);
    }

    // What the effects add to the equations of the motor and its load.
    if (!motor_parts_.empty() || !load_parts_.empty()) {
      reset_motor_terms();
      apply(motor_parts_, middle_);
      if (structure_.measured_load) middle_.omega = Scalar(in.omega);
      apply(load_parts_, middle_);
    }

    // Armature circuit and air gap: the current is linear in the voltages across R and L at both ends of the step.
    const bool conducts = !in.armature_open && structure_.input != Signal::i_a;
    solve_for(h, conducts);
    e0 -= terms_.voltage_drop;
    e1 -= terms_.voltage_drop;
    const Scalar v0 = e0 - k_b_ * omega;
    Scalar mean_current(in.armature_open ? 0.0 : in.i_a);  // over the step, less what the speed at its end will add
    if (conducts) {
      mean_current = mean_.v0 * v0 + mean_.v1 * e1;
      if (inductive_) mean_current += mean_.i * i_a;
    }

    // Shaft and load: trapezoidal, dry friction implicit.
    Scalar torque = k_m_ * mean_current - terms_.braking_torque;
    Scalar dry_friction = terms_.dry_friction;
    if (!structure_.measured_load) {
      torque -= terms_.load_torque;
    } else if (in.load * value_of(omega) >= 0) {
      dry_friction += Scalar(std::abs(in.load));  // a brake takes torque, it does not push: at rest it holds
    } else {
      torque -= Scalar(in.load);
    }
    const Scalar omega_end = soft_threshold(momentum_ * omega + torque, dry_friction) * inverse_inertia_;

    i_a_before_ = i_a;
    if (conducts) {
      const Scalar v1 = e1 - k_b_ * omega_end;
      i_a = inductive_ ? end_.v0 * v0 + end_.v1 * v1 + end_.i * i_a : end_.v1 * v1;
    } else {
      i_a = mean_current;
    }
    theta += 0.5 * h * (omega + omega_end);
    omega_before_ = omega;
    omega = omega_end;
    read_sensors(t + h, h, in);
  }

  Scalar e_driver{};  ///< [V] the driver's output as predicted from the reference
  Scalar i_a{};       ///< [A]
  Scalar omega{};     ///< [rad/s]
  Scalar theta{};     ///< [rad]
  Scalar omega_reading{};
  Scalar i_a_reading{};
  Scalar torque_reading{};  ///< [N m] what the load effects take, from the speed of the model

 private:
  struct Part {
    ApplyEffect<Scalar> apply;
    std::size_t parameter, parameters, memory, memories;
  };
  using Parts = std::vector<Part>;

  /// A current as the armature circuit answers: v0 and v1 across R and L at the start and the end of a step, i at its
  /// start.
  struct Response {
    Scalar v0{}, v1{}, i{};
  };

  /// The state in the middle of the step, extrapolated from the last one: what the effects see.
  void look_at_middle(const StepInput& in, double t, double h) {
    middle_.t = t + 0.5 * h;
    middle_.h = h;
    middle_.u_ref = in.u_ref;
    middle_.e_a = e_driver;
    middle_.i_a = i_a + 0.5 * (i_a - i_a_before_);
    middle_.omega = omega + 0.5 * (omega - omega_before_);
    middle_.theta = theta + 0.5 * h * omega;
  }

  /// The driver as known; effects of the driver change it in every step.
  void reset_driver_terms() {
    const DriverModel& d = structure_.driver;
    terms_.gain = Scalar(d.gain);
    terms_.min = Scalar(d.min);
    terms_.max = Scalar(d.max);
    terms_.rise = Scalar(d.rise);
    terms_.fall = Scalar(d.fall);
  }

  /// The motor of the base model; effects of armature, air gap, shaft and load change it in every step.
  void reset_motor_terms() {
    terms_.resistance = p_[0];
    terms_.viscous = p_[3];
    terms_.flux = Scalar(1.0);
    terms_.inductance = terms_.voltage_drop = Scalar(0.0);
    terms_.braking_torque = terms_.load_torque = terms_.dry_friction = Scalar(0.0);
  }

  void apply(const Parts& parts, const State<Scalar>& x) {
    for (const Part& part : parts) {
      part.apply(p_.subspan(part.parameter, part.parameters), std::span(memory_).subspan(part.memory, part.memories), x,
                 terms_);
    }
  }

  void follow_reference(double u_ref, double h) {
    if (driver_parts_.empty()) {  // all is known, nothing has a derivative
      const DriverModel& d = structure_.driver;
      const double e = value_of(e_driver);
      e_driver = Scalar(e + clamped(clamped(d.gain * u_ref, d.min, d.max) - e, -d.fall * h, d.rise * h));
      return;
    }
    reset_driver_terms();
    terms_.u = Scalar(u_ref);
    apply(driver_parts_, middle_);
    const Scalar target = clamped(terms_.gain * terms_.u, terms_.min, terms_.max);
    e_driver += clamped(target - e_driver, terms_.fall * (-h), terms_.rise * h);
  }

  /// Prepares what a step multiplies by.
  void solve_for(double h, bool conducts) {
    const Balance<Scalar>& b = terms_;
    const bool changed = any(differs(b.resistance, solved_.resistance) | differs(b.inductance, solved_.inductance) |
                             differs(b.flux, solved_.flux) | differs(b.viscous, solved_.viscous));
    if (h == solved_h_ && conducts == solved_conducts_ && !changed) return;
    solved_h_ = h;
    solved_conducts_ = conducts;
    solved_ = {b.resistance, b.inductance, b.flux, b.viscous};
    k_b_ = p_[1] * b.flux;
    k_m_ = p_[2] * b.flux;
    mean_ = end_ = Response{};
    if (conducts) {
      // R i + L di/dt = v, v linear from v0 to v1: i(h) = v1/R - trail + (i - v0/R + trail) carried, trail = (v1 - v0)
      // lag/R.
      const Scalar conductance = 1.0 / b.resistance;
      Scalar lag(0.0), carried(0.0);  // L/R in steps; how much of an initial current is left at the end
      if (inductive_) {
        const Scalar tau = b.inductance * conductance;
        lag = tau / h;
        carried = decay(h, tau);
      }
      const Scalar mean_carried = lag * (1.0 - carried);
      end_ = {(mean_carried - carried) * conductance, (1.0 - mean_carried) * conductance, carried};
      const Scalar late = lag * (1.0 - mean_carried);
      mean_ = {(0.5 + late - mean_carried) * conductance, (0.5 - late) * conductance, mean_carried};
    }
    momentum_ = p_[4] / h - 0.5 * b.viscous;
    inverse_inertia_ = 1.0 / (p_[4] / h + 0.5 * b.viscous + k_m_ * k_b_ * mean_.v1);
  }

  void read_sensors(double t, double h, const StepInput& in) {
    if (sensor_parts_.empty()) {
      omega_reading = omega;
      i_a_reading = i_a;
      torque_reading = terms_.load_torque;
      return;
    }
    terms_.omega_reading = omega;
    terms_.i_a_reading = i_a;
    terms_.torque_reading = terms_.load_torque;
    apply(sensor_parts_,
          {.t = t, .h = h, .u_ref = in.u_ref, .e_a = e_driver, .i_a = i_a, .omega = omega, .theta = theta});
    omega_reading = terms_.omega_reading;
    i_a_reading = terms_.i_a_reading;
    torque_reading = terms_.torque_reading;
  }

  const ModelStructure& structure_;
  std::span<const Scalar> p_;
  Parts driver_parts_, motor_parts_, load_parts_, sensor_parts_;
  std::vector<Scalar> memory_;
  bool inductive_ = false;  ///< false: no inductance, and its terms are not computed
  State<Scalar> middle_;
  Balance<Scalar> terms_;
  Scalar omega_before_{};
  Scalar i_a_before_{};

  // Kept until something that they depend on changes.
  struct Solved {
    Scalar resistance{}, inductance{}, flux{}, viscous{};
  } solved_;
  double solved_h_ = 0;
  bool solved_conducts_ = false;
  Scalar k_b_{}, k_m_{};
  Response mean_, end_;       ///< current: mean over the step, and at its end
  Scalar momentum_{};         ///< J/h - B/2
  Scalar inverse_inertia_{};  ///< 1/(J/h + B/2 + K_m K_b mean_.v1)
};

}  // namespace emtb
