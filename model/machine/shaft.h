#pragma once

#include <cmath>
#include <optional>

#include "model/dual.h"
#include "model/machine/armature.h"
#include "model/machine/dry_friction.h"
#include "model/machine/equations.h"

namespace emtb {

/// [N m] What acts on the shaft: what pulls at it, and what opposes any motion and holds it at rest.
template <class Scalar>
struct ShaftTorque {
  Scalar pull{};
  Scalar dry_friction{};  ///< of the motor
  Scalar brake{};         ///< of the load
  Scalar bristle{};       ///< [N m/rad] of the motor's before it slips; 0: it does not give

  /// What the load effects say of a measured load pulls as they do, as far as the gauge shows it; the rest is a
  /// brake's, which takes torque but does not push: at rest it holds.
  void take_load(const Scalar& measured, const Scalar& said, const Scalar& omega) {
    const bool all = value_of(measured) == 0 || value_of(said) / value_of(measured) > 1;
    const Scalar pulls = all ? measured : said, rest = measured - pulls;
    if (value_of(rest) * value_of(omega) >= 0) {
      pull -= pulls;
      brake += abs(rest);
    } else {
      pull -= measured;
    }
  }
};

/// Tells what a load behind a spring takes in a step: what its effects say or what is measured, and its brake.
/// @param motor [rad/s] its mean speed, as foreseen
/// @return [N m] what the brake takes of it
template <class Scalar>
Scalar take_behind_spring(Balance<Scalar>& terms, const std::optional<Scalar>& measured, const Scalar& motor) {
  LoadBehindSpring<Scalar>& load = terms.behind_spring;
  const Scalar arriving = load.arriving(motor);
  const Scalar braked = clamped(arriving - terms.load_torque, -terms.brake, terms.brake);
  load.taken = terms.load_torque + braked;
  if (!measured) return braked;
  ShaftTorque<Scalar> read;
  read.take_load(*measured, terms.load_torque, load.omega);
  if (std::abs(value_of(braked)) < value_of(terms.brake)) read.brake = larger(read.brake, terms.brake);
  load.taken = clamped(arriving + read.pull, -read.brake, read.brake) - read.pull;
  return braked;
}

/// The shaft, by the trapezoidal rule fitted to its own decay; dry friction by an implicit soft threshold, so that it
/// sticks exactly, and turns round within a step.
///
///     J dω/dt = K_m φ i - B ω - torques - dry friction
///
/// What depends on the armature, J, B and the length of the step only is kept until one of these changes.
template <class Scalar>
class Shaft {
 public:
  /// Where does something differ from what it is solved for?
  auto changed(const Balance<Scalar>& terms) const {
    return differs(terms.inertia, inertia_) | differs(terms.viscous, viscous_);
  }

  void solve(const Armature<Scalar>& armature, const Balance<Scalar>& terms, double h) {
    inertia_ = terms.inertia;
    viscous_ = terms.viscous;
    // With J/h the trapezoidal rule lets the speed decay by (J/h - d)/(J/h + d), where d is half of what damps it; with
    // J/h + d²h/(3J) that is the [2/2] Padé approximant of the exponential: fourth order, and never past zero. A torque
    // that grows over the step then counts more at its end, from which less has decayed.
    const Scalar& k_b = armature.k_b();
    const Scalar& k_m = armature.k_m();
    const Scalar inertia = terms.inertia / h;
    const Scalar conductance = armature.mean().v0 + armature.mean().v1;
    const Scalar decays = terms.behind_spring.there ? terms.viscous - terms.behind_spring.holds_back() : terms.viscous;
    const Scalar damping = 0.5 * (decays + k_m * k_b * conductance);
    late_ = k_m * conductance * damping / (6.0 * inertia);
    const Scalar fitted = inertia + damping * damping / (3.0 * inertia);
    momentum_ = fitted - 0.5 * terms.viscous;
    inverse_inertia_ = 1.0 / (fitted + 0.5 * terms.viscous + k_m * k_b * armature.mean().v1);
  }

  const Scalar& momentum() const { return momentum_; }                ///< J'/h - B/2
  const Scalar& inverse_inertia() const { return inverse_inertia_; }  ///< 1/(J'/h + B/2 + K_m K_b mean.v1)

  /// [N m/V] of a voltage that grows over the step.
  const Scalar& late() const { return late_; }

  /// [rad/s] at the end of the step.
  Scalar speed_after(const Scalar& omega, const ShaftTorque<Scalar>& torque) const {
    return speed_against_friction(omega, (momentum_ * omega + torque.pull) * inverse_inertia_,
                                  (torque.dry_friction + torque.brake) * inverse_inertia_);
  }

  /// The same under dry friction that gives before it slips: a spring, damped as much as it takes not to ring, up to
  /// the torque at which it slips. Implicit.
  Scalar speed_on_bristles(const Scalar& omega, const ShaftTorque<Scalar>& torque, double h) {
    const Scalar& k = torque.bristle;
    const Scalar resists = k * h + 2.0 * pow(k * inertia_, 0.5);
    const Scalar pushed = momentum_ * omega + torque.pull;
    const Scalar held = soft_threshold(pushed - k * bent_, torque.brake) / (1.0 / inverse_inertia_ + resists);
    const Scalar friction = k * bent_ + resists * held;
    if (std::abs(value_of(friction)) <= value_of(torque.dry_friction)) {
      bent_ += h * held;
      return held;
    }
    const Scalar slips = value_of(friction) > 0 ? torque.dry_friction : -torque.dry_friction;
    bent_ = slips / k;
    if (value_of(slips) * value_of(omega) < 0) return speed_after(omega, torque);  // it turns round within the step
    return soft_threshold(pushed - slips, torque.brake) * inverse_inertia_;
  }

  /// [N m] What a brake of the load takes over the step: all that it can while the shaft slides. While it holds, what
  /// the dry friction of the motor leaves it, which is nearer to what pulls.
  Scalar braked(const Scalar& omega, const ShaftTorque<Scalar>& torque) const {
    const Scalar left = soft_threshold(momentum_ * omega + torque.pull, torque.dry_friction);
    return clamped(left, -torque.brake, torque.brake);
  }

 private:
  Scalar viscous_{}, inertia_{};  ///< that it is solved for
  Scalar late_{};
  Scalar bent_{};                          ///< [rad] of the bristles
  Scalar momentum_{}, inverse_inertia_{};  ///< J' is J but for what the trapezoidal rule errs
};

}  // namespace emtb
