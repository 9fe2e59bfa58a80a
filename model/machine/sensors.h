#pragma once

#include <cstddef>

#include "model/dual.h"
#include "model/effect.h"
#include "model/machine/equations.h"
#include "model/machine/late_reading.h"
#include "model/machine/rotor_angle.h"

namespace emtb {

/// What the sensors make of the motion at the end of a step.
template <class Scalar>
class Sensors {
 public:
  /// @param parameter the place of its first one
  void add(std::size_t effect, std::size_t parameter) { effects_.add(effect, parameter); }

  /// Are the readings the state itself?
  bool read_the_state() const { return effects_.empty(); }

  void start() { late_.start(); }

  /// @param t [s] of the end @param h [s] the step; 0: as a run begins
  /// @param e_a [V] at the terminals @param angle is put behind by what the sensors say of it
  void read(const StepInput& in, double t, double h, const Motion<Scalar>& motion, const Scalar& e_a,
            RotorAngle<Scalar>& angle, Equations<Scalar>& equations) {
    Balance<Scalar>& terms = equations.terms;
    if (read_the_state()) {
      omega_reading = motion.omega;
      i_a_reading = motion.i_a;
      torque_reading = terms.load_torque;
      return;
    }
    terms.omega_reading = motion.omega;
    terms.i_a_reading = motion.i_a;
    terms.torque_reading = terms.load_torque;
    terms.load_offset = terms.angle_behind = terms.reading_delay = Scalar(0.0);
    effects_.apply({.t = t,
                    .h = h,
                    .u_ref = in.u_ref,
                    .e_a = e_a,
                    .i_a = motion.i_a,
                    .omega = motion.omega,
                    .theta = angle.at_end(in)},
                   equations);
    omega_reading = terms.omega_reading;
    i_a_reading = terms.i_a_reading;
    torque_reading = terms.torque_reading;
    is_late_ = any(differs(terms.reading_delay, Scalar(0.0)));
    if (is_late_) read_late(t, angle, terms);
    if (in.angle_integrated) {
      angle.put_behind(terms.angle_behind);
    } else if (is_late_) {
      angle.put_behind(angle.theta() - late_theta_);
    }
  }

  /// Speed and angle are read some time later.
  bool late() const { return is_late_; }

  /// [rad] As read.
  const Scalar& theta_reading(const RotorAngle<Scalar>& angle) const { return is_late_ ? late_theta_ : angle.theta(); }

  Scalar omega_reading{}, i_a_reading{};
  Scalar torque_reading{};  ///< [N m] what the load effects take, from the speed of the model

 private:
  /// Speed and angle, as they come over a bus.
  void read_late(double t, const RotorAngle<Scalar>& angle, Balance<Scalar>& terms) {
    const auto [speed, theta] = late_.read(t, terms.reading_delay, {omega_reading, angle.theta()});
    omega_reading = speed;
    late_theta_ = theta;
    terms.angle_behind += angle.theta() - theta;
  }

  EffectParts<Scalar> effects_;
  LateReading<Scalar> late_;
  Scalar late_theta_{};  ///< [rad]
  bool is_late_ = false;
};

}  // namespace emtb
