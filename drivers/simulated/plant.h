#pragma once

#include <vector>

#include "drivers/simulated/plant_parameters.h"

namespace emtb::simulated {

/// A driver, a separately excited DC motor and its load, as they would behave.
///
/// Deliberately not the code of `model/`: classical Runge-Kutta at 0.1 ms or less, friction by another law, exact
/// slopes of the driver. What depends on a current that itself follows at once (armature reaction, discontinuous
/// conduction) sees the current of 0.2 ms ago (other laws: 1 ms), as an iron yoke and a rectifier do; what changes
/// within seconds (heat) is brought along once a step. About 2 us for a millisecond. Not thread-safe.
class Plant {
 public:
  /// At rest, driver at zero (or at the nearest voltage that it can give).
  /// @throws ConfigError where a parameter cannot be: J, R_a, ... not above zero.
  explicit Plant(PlantParameters parameters);

  /// @param dt [s] @param reference [V] held for all of dt
  void advance(double dt, double reference) noexcept;

  // What a person does at the bench.
  void set_load(const LoadParameters& load);  ///< turns the brake. @throws ConfigError as the constructor
  /// The motor itself becomes another: a warm winding, a mass at the shaft, a bearing that rubs. Its state stays.
  /// @throws ConfigError as the constructor
  void become(const PlantParameters& parameters);
  void open_armature(bool open) noexcept;  ///< the contactor: no current flows, the terminals show the back-EMF
  bool armature_open() const noexcept { return open_; }

  // The truth at the present time; ammeter(), tacho() and gauge() after what these sensors themselves do to it.
  double time() const noexcept { return time_; }          ///< [s] since construction
  double e_a() const noexcept;                            ///< [V]
  double i_a() const noexcept { return state_.i; }        ///< [A]
  double ammeter() const noexcept;                        ///< [A] i_a, or what of it the supply gives
  double omega() const noexcept { return state_.omega; }  ///< [rad/s]
  double theta() const noexcept { return state_.theta; }  ///< [rad] unbounded
  double tacho() const noexcept;                          ///< [rad/s]
  double encoder() const noexcept;                        ///< [rad] theta, as late as the tacho
  double load_torque() const noexcept;                    ///< [N m] at the shaft
  double gauge() const noexcept;                          ///< [N m] after its lag
  double charge() const noexcept {
    return state_.charge;
  }  ///< [A s] integral of ammeter(): its differences are exact means
  double squares() const noexcept { return state_.squares; }  ///< [A2 s] integral of its square: of an rms meter
  double warmer() const noexcept { return winding_; }         ///< [K] of the armature above where it began

  const PlantParameters& parameters() const noexcept { return p_; }

 private:
  /// What is integrated; of its slopes, e has none of its own.
  struct State {
    double e = 0;  ///< [V] inside the driver, after its slopes
    double i = 0;
    double omega = 0;
    double theta = 0;
    double charge = 0;
    double squares = 0;
    double heat = 0;                ///< [A2 s] integral of i squared
    double past = 0;                ///< [A] the current as flux and rectifier see it
    double lag_1 = 0, lag_2 = 0;    ///< [V] of the driver
    double omega_2 = 0, twist = 0;  ///< of the load behind a compliant shaft
    double tacho_1 = 0, tacho_2 = 0;
    double gauge_1 = 0, gauge_2 = 0;
  };
  /// Dry friction during one step: a constant torque, some damping while the bristle bends, or stuck.
  struct Grip {
    double torque = 0;            ///< [N m]
    double damping = 0;           ///< [N m s/rad]
    double lowest = 0, most = 0;  ///< [N m] of both together
    bool stuck = false;
  };
  /// Speed and angle on their way over a bus.
  struct Reading {
    double t = 0;
    double tacho = 0, theta = 0;
  };
  /// A change of the reference on its way through the driver.
  struct Change {
    double due = 0;
    double value = 0;
  };

  void derive();

  /// f(member) for each number that this plant integrates: most benches need only the first five.
  template <class Function>
  void each(Function f) const noexcept;
  State along(const State& from, const State& slope, double dt) const noexcept;
  void send(double reference) noexcept;
  void receive() noexcept;
  void step(double dt) noexcept;
  void remember(double dt, double heat) noexcept;
  double driver_after(double e, double dt) const noexcept;
  double output(const State& x, double e, double t) const noexcept;
  double wave(double e, double t) const noexcept;
  double mean_output(const State& x, double e) const noexcept;
  bool lets_go() const noexcept;
  bool blocks(double driving, double mean, double i) const noexcept;
  double withheld(double driving, double i) const noexcept;
  double at_terminals(const State& x, double e, double t, double i) const noexcept;
  double read_current(double i, double e_a) const noexcept;
  double brush_drop(double i) const noexcept;
  double flux(double past) const noexcept;
  double armature_current(double voltage, double mean, double guess) const noexcept;
  double back_emf(const State& x) const noexcept;  // [V]
  double driving_voltage(const State& x, double e, double t) const noexcept;
  double load_torque(double omega, double theta) const noexcept;
  double shaft_torque(const State& x) const noexcept;
  double slip_torque(double omega, double direction) const noexcept;
  double torque_in_gears() const noexcept;
  static double held(const Grip& grip, double omega) noexcept;
  double torque_without_friction(const State& x, double i, double t) const noexcept;
  double rippled(const State& x) const noexcept;
  Reading read_now() const noexcept;
  Reading arrived() const noexcept;
  void send_reading() noexcept;
  State slope(const State& x, double e, double t, const Grip& grip, double& i) const noexcept;
  State integrate(const State& from, double dt, const Grip& grip) const noexcept;
  void step_bristle(double dt) noexcept;
  void step_hard(double dt, int depth) noexcept;
  Grip bend(double dt) noexcept;
  void bend_lining(double dt) noexcept;

  PlantParameters p_;
  State state_;
  double time_ = 0;

  // What follows from the parameters.
  double longest_step_ = 0;  ///< [s]
  double inductance_ = 0;    ///< [H] 0 where too small to matter
  double see_ = 0;           ///< [s] lag of the current that flux and rectifier see; 0: nobody looks
  double lag_1_ = 0, lag_2_ = 0, tacho_1_ = 0, tacho_2_ = 0, gauge_1_ = 0, gauge_2_ = 0;  ///< [s] 0: none
  double inertia_ = 0;            ///< [kg m2] of the motor's side
  double stiffness_ = 0;          ///< [N m/rad] of the bristle
  double damping_ = 0;            ///< [N m s/rad] of the bristle
  bool takes_none_back_ = false;  ///< the driver lets no current flow against its voltage
  bool one_way_ = false;          ///< nor in more than one direction
  bool rare_ = false;             ///< lags or two bodies are integrated, too

  // What is brought along step by step.
  double target_ = 0;               ///< [V] of the driver
  double followed_ = 0;             ///< [V] of reference, after the play
  double sent_ = 0;                 ///< [V] the last that went on its way
  std::vector<Change> on_its_way_;  ///< a ring
  std::size_t first_ = 0, waiting_ = 0;
  std::vector<Reading> on_the_bus_;  ///< a ring
  std::size_t newest_ = 0;
  double resistance_ = 0;          ///< [ohm] armature, warm, and driver
  double winding_ = 0, iron_ = 0;  ///< [K] above the start
  double field_ = 1, grease_ = 1;  ///< what is left of flux and friction
  double turned_over_ = 0;         ///< [A] of the flux's hysteresis
  double disc_ = 0;                ///< [J] in the eddy brake's disc
  double stuck_reading_ = 0;       ///< [rad/s] of a tacho whose coupling sticks
  double bristle_ = 0;             ///< [rad]
  double lining_ = 0;              ///< [rad] of the load's brake
  Grip brake_;                     ///< of that, during one step
  bool stuck_ = true;              ///< the hard law's state
  bool open_ = false;              ///< the contactor in the armature circuit
};

}  // namespace emtb::simulated
