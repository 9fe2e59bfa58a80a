#pragma once

#include <cstddef>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "model/catalogue.h"
#include "model/effect.h"

namespace emtb {

/// What drives one step, from the data or from the stage above.
struct StepInput {
  double u_ref = 0;      ///< [V] held over the step
  double e_a_mean = 0;   ///< [V] terminal voltage, over the step; used where the structure says `measured_voltage`
  double e_a_end = 0;    ///< [V]
  double i_a = 0;        ///< [A] of a current drive, held over the step
  double load = 0;       ///< [N m] measured load torque, mean over the step: a passive load
  double omega = 0;      ///< [rad/s] measured speed in the middle: what a measured load's effects see, see SpeedAsRead
  double omega_end = 0;  ///< [rad/s] the same at the end, where the gauge is read
  std::optional<double> angle_middle, angle_end;  ///< [rad] measured: what periodic effects see; absent: as simulated
  std::optional<double> angle_pull;               ///< [1/s] see Excitation::angle_pull
  bool angle_integrated = false;                  ///< see Excitation::angle_integrated
  double temperature = std::numeric_limits<double>::quiet_NaN();  ///< [degC] where measured
  bool armature_open = false;
};

/// What moves, now and a step before.
template <class Scalar>
struct Motion {
  Scalar i_a{};    ///< [A]
  Scalar omega{};  ///< [rad/s]
  Scalar i_a_before{}, omega_before{};

  /// Extrapolated to the middle of the step to come.
  Scalar i_a_in_middle() const { return i_a + 0.5 * (i_a - i_a_before); }
  Scalar omega_in_middle() const { return omega + 0.5 * (omega - omega_before); }

  /// The same to its end.
  Scalar omega_at_end() const { return 2.0 * omega - omega_before; }
};

/// The equations of one step, which the stages of a machine share.
template <class Scalar>
struct Equations {
  std::span<const Scalar> p;  ///< all parameters, in the order of the structure
  State<Scalar> middle;       ///< the state in the middle of the step, extrapolated: what effects see
  Balance<Scalar> terms;      ///< what the effects act on
};

/// Which terms of the equations there are: what is not there costs no time.
struct TermsThere {
  bool reaction = false, light_load_rise = false, chopping = false, current_limit = false, contact_drop = false;
  bool gear_friction = false, brake = false, bristle = false;
  bool operator==(const TermsThere&) const = default;
};

template <class Scalar>
TermsThere terms_in(const Balance<Scalar>& terms) {
  const auto there = [](const Scalar& term) { return any(differs(term, Scalar(0.0))); };
  return {.reaction = there(terms.reaction),
          .light_load_rise = there(terms.light_load_rise),
          .chopping = there(terms.chop_period),
          .current_limit = any(differs(terms.current_limit, Scalar(infinity))),
          .contact_drop = there(terms.contact_drop),
          .gear_friction = there(terms.gear_friction),
          .brake = there(terms.brake),
          .bristle = there(terms.bristle)};
}

/// The motor of the base model; effects of armature, air gap, shaft and load change it in every step.
template <class Scalar>
void reset_motor(Equations<Scalar>& equations) {
  Balance<Scalar>& terms = equations.terms;
  terms.resistance = equations.p[base::R_a];
  terms.viscous = equations.p[base::B];
  terms.inertia = equations.p[base::J];
  terms.flux = Scalar(1.0);
  terms.gap = terms.reaction = Scalar(0.0);
  terms.inductance = terms.contact_drop = terms.contact_knee = Scalar(0.0);
  terms.braking_torque = terms.load_torque = terms.dry_friction = Scalar(0.0);
  terms.gear_friction = terms.brake = terms.bristle = Scalar(0.0);
}

/// The effects of one stage or several, with the memory that they keep.
template <class Scalar>
class EffectParts {
 public:
  /// @param parameter the place of its first one
  void add(std::size_t effect, std::size_t parameter) {
    const EffectInfo& info = effect_catalogue()[effect];
    parts_.push_back({apply_of<Scalar>(effect), parameter, info.parameter_count, memory_.size(), info.memory});
    memory_.resize(memory_.size() + info.memory);
    steady_ = steady_ && is_steady(effect);
  }

  bool empty() const { return parts_.empty(); }

  /// Do they add the same in every step?
  bool steady() const { return steady_; }

  void apply(const State<Scalar>& x, Equations<Scalar>& equations) {
    for (const Part& part : parts_) {
      part.apply(equations.p.subspan(part.parameter, part.parameters),
                 std::span(memory_).subspan(part.memory, part.memories), x, equations.terms);
    }
  }

 private:
  struct Part {
    ApplyEffect<Scalar> apply;
    std::size_t parameter, parameters, memory, memories;
  };
  std::vector<Part> parts_;
  std::vector<Scalar> memory_;
  bool steady_ = true;
};

/// [N m] What opposes the motion, of several effects.
template <class Scalar>
struct Braking {
  Scalar torque{}, dry_friction{};
};

/// The effects of the motor. Some only brake, by the speed or, as detents, by the angle: beside others that add the
/// same in every step, they alone are asked again.
template <class Scalar>
class MotorParts {
 public:
  void add(std::size_t effect, std::size_t parameter) {
    all_.add(effect, parameter);
    const EffectInfo& info = effect_catalogue()[effect];
    any_detent_ = any_detent_ || info.is_detent();
    (info.is_detent() || info.brakes_by_speed ? brakes_ : others_).add(effect, parameter);
  }

  /// Do all that do more than brake add the same in every step?
  bool steady() const { return others_.steady(); }
  bool any_brake() const { return !brakes_.empty(); }
  bool any_detent() const { return any_detent_; }

  void apply(const State<Scalar>& x, Equations<Scalar>& equations) { all_.apply(x, equations); }
  void apply_others(const State<Scalar>& x, Equations<Scalar>& equations) { others_.apply(x, equations); }

  /// @param others what all else brakes
  void brake(const Braking<Scalar>& others, Equations<Scalar>& equations) {
    if (!any_brake()) return;
    equations.terms.braking_torque = others.torque;
    equations.terms.dry_friction = others.dry_friction;
    brakes_.apply(equations.middle, equations);
  }

 private:
  EffectParts<Scalar> all_, others_, brakes_;
  bool any_detent_ = false;
};

}  // namespace emtb
