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
template <class Scalar>
class Machine {
 public:
  /// @param p all parameters of the structure, in its order; must outlive the machine
  Machine(const ModelStructure& structure, std::span<const Scalar> p) : structure_(structure), p_(p) {
    std::size_t parameter = ModelStructure::base_count;
    std::size_t memory = 0;
    for (const std::size_t effect : structure.effects) {
      const EffectInfo& info = effect_catalogue()[effect];
      parts_.push_back({apply_of<Scalar>(effect), info.stage, parameter, info.parameter_count, memory, info.memory});
      parameter += info.parameter_count;
      memory += info.memory;
      circuit_effects_ |= info.stage == Stage::armature;
    }
    memory_.resize(memory);
  }

  /// Puts the machine into its state at the start of a run, and takes the first readings.
  void start(const InitialState& initial, const StepInput& input) {
    omega = omega_before_ = Scalar(initial.omega);
    theta = Scalar(initial.theta);
    i_a = i_a_before_ = Scalar(initial.i_a);
    Balance<Scalar> b = terms();
    apply(Stage::driver, {.u_ref = input.u_ref}, b, input.u_ref);
    e_driver = initial.e_driver ? Scalar(*initial.e_driver) : clamped(b.gain * b.u, b.min, b.max);
    read_sensors(0, 0, input, b);
  }

  /// Advances from t to t + h.
  void step(const StepInput& in, double t, double h) {
    const Scalar omega_mid = omega + 0.5 * (omega - omega_before_);
    const State<Scalar> mid{.t = t + 0.5 * h,
                            .h = h,
                            .u_ref = in.u_ref,
                            .e_a = e_driver,
                            .i_a = i_a + 0.5 * (i_a - i_a_before_),
                            .omega = omega_mid,
                            .theta = theta + 0.5 * h * omega};
    Balance<Scalar> b = terms();

    // Driver: u_ref -> e_a.
    Scalar e0 = e_driver;
    if (structure_.input == Signal::u_ref) {
      apply(Stage::driver, mid, b, in.u_ref);
      const Scalar target = clamped(b.gain * b.u, b.min, b.max);
      e_driver += clamped(target - e_driver, b.fall * (-h), b.rise * h);
    }
    Scalar e1 = e_driver;
    if (structure_.measured_voltage) {
      e0 = Scalar(in.e_a_start);
      e1 = Scalar(in.e_a_end);
    }

    State<Scalar> at_load = mid;
    if (structure_.measured_load) at_load.omega = Scalar(in.omega);
    for (const Part& part : parts_) {
      if (part.stage > Stage::driver && part.stage < Stage::sensors) {
        call(part, part.stage == Stage::load ? at_load : mid, b);
      }
    }

    // Armature circuit and air gap: the mean current over the step is alpha - beta K_b φ ω(t + h).
    const Scalar k_b = p_[1] * b.flux;
    const Scalar k_m = p_[2] * b.flux;
    const bool current_drive = structure_.input == Signal::i_a;
    const bool conducts = !in.armature_open && !current_drive;
    const Scalar& R = b.resistance;
    const Scalar v0 = e0 - b.voltage_drop - k_b * omega;  // across R and L at the start
    Scalar tau(0.0), carried(0.0), mean_carried(0.0);     // carried: how much of an initial current is left at the end
    if (conducts && circuit_effects_) {
      tau = b.inductance / R;
      carried = decay(h, tau);
      mean_carried = tau * (1.0 - carried) / h;
    }
    Scalar alpha(current_drive && !in.armature_open ? in.i_a : 0.0), beta(0.0);
    if (conducts) {
      // i(t) for v linear from v0 to v1: v/R - (v1 - v0) tau/(R h) + transient. Split into what v1 does (beta) and the
      // rest.
      const Scalar lag = tau / h;
      beta = (0.5 - lag * (1.0 - mean_carried)) / R;
      alpha = v0 * (0.5 + lag * (1.0 - mean_carried)) / R + (i_a - v0 / R) * mean_carried;
      alpha += beta * (e1 - b.voltage_drop);
    }

    // Shaft and load: trapezoidal, dry friction implicit.
    Scalar load = b.load_torque;
    if (structure_.measured_load) {
      // A brake takes torque, it does not push: at rest it holds, and never reverses the motion.
      if (in.load * value_of(omega) >= 0) {
        b.dry_friction += Scalar(std::abs(in.load));
        load = Scalar(0.0);
      } else {
        load = Scalar(in.load);
      }
    }
    const Scalar& J = p_[4];
    const Scalar drive = J * omega / h + k_m * alpha - 0.5 * b.viscous * omega - b.braking_torque - load;
    const Scalar inertia = J / h + k_m * k_b * beta + 0.5 * b.viscous;
    const Scalar omega_end = soft_threshold(drive, b.dry_friction) / inertia;

    i_a_before_ = i_a;
    if (conducts) {
      const Scalar v1 = e1 - b.voltage_drop - k_b * omega_end;
      const Scalar trail = (v1 - v0) * tau / (R * h);
      i_a = v1 / R - trail + (i_a - v0 / R + trail) * carried;
    } else {
      i_a = alpha;
    }
    theta += 0.5 * h * (omega + omega_end);
    omega_before_ = omega;
    omega = omega_end;
    read_sensors(t + h, h, in, b);
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
    Stage stage;
    std::size_t parameter, parameters, memory, memories;
  };

  Balance<Scalar> terms() const {
    const DriverModel& d = structure_.driver;
    Balance<Scalar> b;
    b.gain = Scalar(d.gain);
    b.min = Scalar(d.min);
    b.max = Scalar(d.max);
    b.rise = Scalar(d.rise);
    b.fall = Scalar(d.fall);
    b.resistance = p_[0];
    b.flux = Scalar(1.0);
    b.viscous = p_[3];
    return b;
  }

  void call(const Part& part, const State<Scalar>& x, Balance<Scalar>& b) {
    part.apply(p_.subspan(part.parameter, part.parameters), std::span(memory_).subspan(part.memory, part.memories), x,
               b);
  }

  void apply(Stage stage, const State<Scalar>& x, Balance<Scalar>& b, double u_ref) {
    b.u = Scalar(u_ref);
    for (const Part& part : parts_) {
      if (part.stage == stage) call(part, x, b);
    }
  }

  void read_sensors(double t, double h, const StepInput& in, Balance<Scalar>& b) {
    b.omega_reading = omega;
    b.i_a_reading = i_a;
    b.torque_reading = b.load_torque;
    const State<Scalar> end{
        .t = t, .h = h, .u_ref = in.u_ref, .e_a = e_driver, .i_a = i_a, .omega = omega, .theta = theta};
    for (const Part& part : parts_) {
      if (part.stage == Stage::sensors) call(part, end, b);
    }
    omega_reading = b.omega_reading;
    i_a_reading = b.i_a_reading;
    torque_reading = b.torque_reading;
  }

  const ModelStructure& structure_;
  std::span<const Scalar> p_;
  std::vector<Part> parts_;
  std::vector<Scalar> memory_;
  bool circuit_effects_ = false;  ///< false: no inductance, and its exponential is not computed
  Scalar omega_before_{};
  Scalar i_a_before_{};
};

}  // namespace emtb
