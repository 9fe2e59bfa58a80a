#pragma once

namespace emtb {

/// The load as a body of its own, behind the spring of a shaft that twists:
///
///     J_2 domega_2/dt = k twist + d (omega - omega_2) - load
///
/// by the trapezoidal rule over a step, in which the mean speed of the motor and what the load takes are yet to come.
template <class Scalar>
struct LoadBehindSpring {
  bool there = false;  ///< otherwise what the load takes is taken from the motor
  double h = 0;        ///< [s] of the step
  Scalar inertia{};    ///< [N m s/rad] 2 J_2/h
  Scalar stiffness{};  ///< [N m s/rad] k h/2 + d, by which the spring passes on the mean speed; 0 within a play
  Scalar pushed{};     ///< [N m] by its own motion and by the spring as it is bent
  Scalar omega{};      ///< [rad/s] at the start of the step
  Scalar twist{};      ///< [rad] of the motor against it
  Scalar taken{};      ///< [N m] mean of what the load takes, over the step before until it is told for this one

  /// [N m s/rad] By how much the mean speed of the motor is braked, as by viscous friction that is none.
  Scalar holds_back() const { return stiffness * inertia / (inertia + stiffness); }

  /// [N m] What comes to the load to be taken before it is at rest.
  Scalar arriving(const Scalar& motor) const { return pushed + stiffness * motor; }

  /// [rad/s] Its own over the step. @param motor [rad/s] the motor's
  Scalar mean_speed(const Scalar& motor) const { return (arriving(motor) - taken) / (inertia + stiffness); }

  /// The step is over. @param motor [rad/s] its mean speed, as it was
  void end_step(const Scalar& motor) {
    const Scalar mean = mean_speed(motor);
    twist += h * (motor - mean);
    omega = 2.0 * mean - omega;
  }

  /// [N m] What the motor feels of what the load takes within the step; the rest is taken from the load's momentum.
  Scalar felt() const { return taken * stiffness / (inertia + stiffness); }

  /// Of what is seen of the motor in the middle of the step, what is seen of the load.
  /// @param motor [rad/s] as foreseen
  template <class State>
  State seen_in_middle(const State& x, const Scalar& motor) const {
    if (!there) return x;
    const Scalar slips = motor - mean_speed(motor);
    return behind(x, slips, twist + 0.5 * h * slips);
  }

  /// The same at its end.
  /// @param motor, motor_end [rad/s] mean and end
  template <class State>
  State seen_at_end(const State& x, const Scalar& motor, const Scalar& motor_end) const {
    if (!there) return x;
    const Scalar mean = mean_speed(motor);
    return behind(x, motor_end - (2.0 * mean - omega), twist + h * (motor - mean));
  }

 private:
  template <class State>
  static State behind(State x, const Scalar& slips, const Scalar& twisted) {
    x.omega -= slips;
    x.theta -= twisted;
    x.place -= twisted;
    return x;
  }
};

}  // namespace emtb
