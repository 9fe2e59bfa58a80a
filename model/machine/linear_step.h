#pragma once

#include <cstddef>
#include <type_traits>

#include "model/dual.h"
#include "model/machine/armature.h"
#include "model/machine/dry_friction.h"
#include "model/machine/equations.h"
#include "model/machine/plain_rows.h"
#include "model/machine/shaft.h"

namespace emtb {

/// Instead of what brakes at a speed.
struct NothingBrakes {};
inline constexpr NothingBrakes nothing_brakes;

/// The step of model/step.h multiplied out, where all of it but dry friction is linear and stays from step to step, but
/// for effects that only brake:
///
///     ω(h) = S(ω, a ω + b0 e(0) + b1 e(h) + c i - t, t_dry)
///     i(h) = v0 (e(0) - K_b ω) + v1 (e(h) - K_b ω(h)) + r i
///
/// S is the speed against dry friction, t what a torque changes the speed by in a step; v0 = c = r = 0 without an
/// inductance.
template <class Scalar>
class LinearStep {
 public:
  LinearStep() = default;
  /// @param armature, shaft solved for the length of the step
  /// @param braking of effects that do more than brake
  LinearStep(const Armature<Scalar>& armature, const Shaft<Scalar>& shaft, const Balance<Scalar>& terms,
             const Braking<Scalar>& braking)
      : inductive_(armature.inductive()) {
    const Response<Scalar>&mean = armature.mean(), &end = armature.end();
    const Scalar &k_b = armature.k_b(), &k_m = armature.k_m(), &by_torque = shaft.inverse_inertia();
    omega_by_ = {by_torque * (shaft.momentum() - k_m * mean.v0 * k_b), by_torque * (k_m * mean.v0 - shaft.late()),
                 by_torque * (k_m * mean.v1 + shaft.late()), by_torque * (k_m * mean.i)};
    by_torque_ = by_torque;
    load_ = by_torque * (terms.load_torque + braking.torque);
    friction_ = by_torque * braking.dry_friction;
    i_by_ = {-(end.v0 * k_b), end.v0, end.v1, end.i};
    i_by_omega_end_ = -(end.v1 * k_b);
  }

  /// [rad/s] at the end of a step.
  /// @param start, end [V] of the voltage, which is linear in between
  template <class Voltage>
  Scalar omega_end(const Scalar& omega, const Scalar& i_a, const Voltage& start, const Voltage& end) const {
    Scalar pushed = omega_by_.start * start + omega_by_.end * end - load_;
    if (inductive_) pushed += omega_by_.i_a * i_a;
    return speed_against_friction(omega, pushed + omega_by_.omega * omega, friction_);  // what is waited for comes last
  }

  /// The same where something brakes besides.
  template <class Voltage>
  Scalar omega_end_under(const Braking<Scalar>& braking, const Scalar& omega, const Scalar& i_a, const Voltage& start,
                         const Voltage& end) const {
    Scalar pushed = omega_by_.start * start + omega_by_.end * end - load_;
    if (inductive_) pushed += omega_by_.i_a * i_a;
    return speed_against_friction(omega, pushed + omega_by_.omega * omega - by_torque_ * braking.torque,
                                  friction_ + by_torque_ * braking.dry_friction);
  }

  /// [A] at the end of a step.
  template <class Voltage>
  Scalar i_a_end(const Scalar& omega, const Scalar& i_a, const Voltage& start, const Voltage& end,
                 const Scalar& omega_end) const {
    Scalar current = i_by_.end * end;
    if (inductive_) current += i_by_.start * start + i_by_.omega * omega + i_by_.i_a * i_a;
    return current + i_by_omega_end_ * omega_end;
  }

  /// Many steps, one after the other. The state stays in registers: nothing of what the steps need is written.
  /// @param motion, theta of the machine; moved on @param voltage [V] the ramp at the terminals over each step
  /// @param braking what brakes at a speed in the middle of a step, or nothing_brakes
  /// @param at_terminals [V] what is read there at a current
  template <class Voltage, class By, class Terminals>
  void go_on(Motion<Scalar>& motion, Scalar& theta, const Voltage& voltage, const By& braking,
             const Terminals& at_terminals, std::size_t count, double h, PlainRows<Scalar>& out) const {
    const LinearStep<Scalar> step = *this;
    Motion<Scalar> now = motion;
    Scalar angle = theta;
    for (std::size_t j = 0; j < count; ++j) {
      const auto e = voltage(j);
      const Scalar omega_in_middle = now.omega_in_middle();
      now.omega_before = now.omega;
      now.i_a_before = now.i_a;
      if constexpr (std::is_same_v<By, NothingBrakes>) {
        now.omega = step.omega_end(now.omega_before, now.i_a_before, e.start, e.end);
      } else {
        now.omega = step.omega_end_under(braking(omega_in_middle), now.omega_before, now.i_a_before, e.start, e.end);
      }
      now.i_a = step.i_a_end(now.omega_before, now.i_a_before, e.start, e.end, now.omega);
      angle += 0.5 * h * (now.omega_before + now.omega);
      out.e_a[j] = at_terminals(now.i_a);
      out.i_a[j] = now.i_a;
      out.omega[j] = now.omega;
      out.theta[j] = angle;
    }
    motion = now;
    theta = angle;
  }

 private:
  /// What each at the start of a step, and the voltage at its end, add to what is there at the end.
  struct By {
    Scalar omega{}, start{}, end{}, i_a{};
  };

  bool inductive_ = false;
  By omega_by_, i_by_;
  Scalar i_by_omega_end_{};
  Scalar by_torque_{};          ///< [rad/s] that each N m takes in a step
  Scalar load_{}, friction_{};  ///< [rad/s] that they take
};

}  // namespace emtb
