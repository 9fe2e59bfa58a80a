#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <span>

#include "model/catalogue.h"
#include "model/dual.h"
#include "model/effect.h"
#include "model/machine/armature.h"
#include "model/machine/blocked_current.h"
#include "model/machine/driver.h"
#include "model/machine/equations.h"
#include "model/machine/first_current.h"
#include "model/machine/linear_step.h"
#include "model/machine/reaction.h"
#include "model/machine/rotor_angle.h"
#include "model/machine/sensors.h"
#include "model/machine/shaft.h"
#include "model/machine/source_under_load.h"
#include "model/machine/speed_as_read.h"
#include "model/machine/user_terms.h"
#include "model/simulation.h"
#include "model/standstill.h"
#include "model/structure.h"

namespace emtb {

/// The machine, one step at a time: reference -> driver -> armature circuit -> air gap -> shaft -> load -> sensors.
///
///     e_a     = R_a i + L_a di/dt + K_b φ ω + V                  (1), (3) of Erdal et al. (2011)
///     K_m φ i = J dω/dt + B ω + T_load + T_smooth + T_dry        (4), (5)
///
/// One step h solves both at once, second order, for any L_a >= 0:
///  - the armature circuit exactly, for a voltage that is linear over the step, so that L_a may be 0;
///  - the shaft by the trapezoidal rule, fitted to its own decay; dry friction by an implicit soft threshold, so that
///  the shaft sticks exactly, and the voltage that brushes drop alike;
///  - what the effects contribute at the extrapolated middle of the step.
///
/// What depends on R_a, L_a, K_b, K_m, B, J and h only is kept; effects that add the same in every step are asked once.
template <class Scalar>
class Machine : public Motion<Scalar> {
 public:
  /// @param p all parameters of the structure, in its order, and optionally one more: an angle to add to that of the
  /// rotor at the start; must outlive the machine
  Machine(const ModelStructure& structure, std::span<const Scalar> p)
      : structure_(structure),
        driver_(structure.driver),
        angle_(p.size() > structure.parameter_count() ? p[structure.parameter_count()] : Scalar{}) {
    equations_.p = p;
    std::size_t parameter = ModelStructure::base_count;
    for (const std::size_t effect : structure.effects) {
      const EffectInfo& info = effect_catalogue()[effect];
      if (info.stage == Stage::driver) {
        driver_.add(effect, parameter);
      } else if (info.stage == Stage::sensors) {
        sensors_.add(effect, parameter);
      } else if (info.stage == Stage::load) {
        load_.add(effect, parameter);
      } else {
        motor_.add(effect, parameter);
      }
      parameter += info.parameter_count;
    }
    for (const PlacedTerm& term : structure.terms) {
      user_.add(term, parameter);
      parameter += term.parameter_count;
    }
    driver_.reset(equations_.terms);
    is_steady_ = driver_.steady() && motor_.steady() && load_.steady() && structure.terms.empty();
  }

  /// Goes on with other parameters.
  void follow(std::span<const Scalar> p) {
    equations_.p = p;
    driver_.forget();
    is_gathered_ = false;
  }

  /// Puts the machine into its state at the start of a run, and takes the first readings.
  void start(const InitialState& initial, const StepInput& in) {
    field_on_ = initial.field_on;
    is_gathered_ = false;
    reset_motor(equations_);
    sensors_.start();
    source_ = {};
    omega = omega_before = Scalar(initial.omega);
    angle_.start(initial.theta, shortest_period(structure_, equations_.p), in);
    driver_.start(in.u_ref, initial, equations_);
    i_a = i_a_before = first_current(structure_, equations_, driver_, omega, initial, in);
    if (initial.e_driver && initial.as_read) driver_.stand_behind_terminals(equations_.terms, i_a);
    e_a_reading = driver_.voltage() - equations_.terms.output_resistance * i_a;
    equations_.middle = {.u_ref = in.u_ref, .e_a = driver_.voltage(), .i_a = i_a, .omega = omega};
    equations_.middle.theta = equations_.middle.place = angle_.theta();
    user_.start(equations_);
    if (structure_.measured_load) equations_.middle.omega = Scalar(in.omega);
    load_.apply(equations_.middle, equations_);
    equations_.terms.behind_spring.taken = equations_.terms.load_torque;
    if (initial.omega != 0)
      equations_.terms.load_torque += initial.omega > 0 ? equations_.terms.brake : -equations_.terms.brake;
    read_sensors(0, 0, in);
    if (!initial.as_read) return;
    if (initial.omega != 0) omega = omega_before = initial.omega - (omega_reading() - omega);
    if (initial.i_a && *initial.i_a != 0) i_a = i_a_before = *initial.i_a - (i_a_reading() - i_a);
    read_sensors(0, 0, in);
  }

  /// Advances from t to t + h.
  void step(const StepInput& in, double t, double h) {
    if (!is_steady_ || motor_.any_brake()) look_at_middle(in, t, h);
    const Ramp<Scalar> driven = drive(in.u_ref, t, h);
    gather_motor_terms(in);
    if (!is_linear_ || in.armature_open || means_asked_) {
      step_in_general(in, driven, terminals(in, driven), h);
    } else if (added_) {
      const Ramp<Scalar> e = terminals(in, driven);
      step_linearly(e.start, e.end, h);
    } else if (structure_.measured_voltage) {
      step_linearly(2 * in.e_a_mean - in.e_a_end, in.e_a_end, h);
    } else {
      step_linearly(driven.start, driven.end, h);
    }
    angle_.advance(in, h, 0.5 * h * (omega_before + omega));
    look_at_load(in, t + h);
    read_sensors(t + h, h, in);
  }

  /// Does it stand, so that the next step leaves all as it was under the same inputs, if it keeps_no_past()?
  /// @param driver_before [V] before the last step
  bool stood_still(Stand<Scalar>& stand, const Scalar& driver_before) const {
    const bool speed = stand.omega.see(omega_before, omega), current = stand.i_a.see(i_a_before, i_a);
    return stand.driver.see(driver_before, driver_.voltage()) && speed && current && !is_there_.bristle &&
           !sensors_.late();
  }

  /// Goes on through such a step: it turns as it turned.
  void go_on_alike(const StepInput& in, double h) { angle_.advance(in, h, h * omega); }

  /// Is the step linear but for what brakes by the speed? Not told before the first step.
  /// @param by_angle_read the angle is measured, and put behind by sensors
  bool is_plain(bool by_angle_read) const {
    return is_linear_ && is_gathered_ && !motor_.any_detent() && (sensors_.read_the_state() || !by_angle_read);
  }

  /// Steps of such a machine with a closed armature, which take little more time than their sums.
  /// @param row the first, in what drives it @param count at most PlainRows::most @param h [s] of each
  void step_plainly(const PlainDrive& drive, std::size_t row, std::size_t count, double h, PlainRows<Scalar>& out) {
    solve_linear_step(h);
    const auto driven = [&](std::size_t j) { return this->drive(drive.reference(row + j), drive.t[row + j], h); };
    const auto measured = [&](std::size_t j) { return driven(j), drive.voltage(row + j); };
    const auto at_terminals = [&](const Scalar& i) { return driver_.voltage_under(equations_.terms, i); };
    const auto braking = [&](const Scalar& speed) {
      equations_.middle.omega = speed;
      motor_.brake(steady_braking_, equations_);
      return braking_beside_steady();
    };
    Scalar theta = angle_.theta();
    const auto go_on = [&](const auto& voltage) {
      motor_.any_brake() ? linear_.go_on(*this, theta, voltage, braking, at_terminals, count, h, out)
                         : linear_.go_on(*this, theta, voltage, nothing_brakes, at_terminals, count, h, out);
    };
    structure_.measured_voltage ? go_on(measured) : go_on(driven);
    e_a_reading = out.e_a[count - 1];
    sensors_.omega_reading = omega;
    sensors_.i_a_reading = i_a;
    angle_.turn_to(theta);
  }

  /// What the sensors make of the end of such a step.
  /// @param row the step's, in what drives it @param j in out, where each is asked in turn
  SimulatedReadings<Scalar> read_plainly(const PlainDrive& drive, std::size_t row, std::size_t j, double h,
                                         const PlainRows<Scalar>& out) {
    if (sensors_.read_the_state()) return {out.e_a[j], out.i_a[j], out.omega[j], out.theta[j], sensors_.torque_reading};
    omega = out.omega[j];
    i_a = out.i_a[j];
    e_a_reading = out.e_a[j];
    angle_.turn_to(out.theta[j]);
    StepInput in;
    in.u_ref = drive.reference(row);
    in.e_a_end = drive.terminals(row + 1);
    read_sensors(drive.t[row] + h, h, in);
    return readings();
  }

  using Motion<Scalar>::i_a, Motion<Scalar>::omega;
  Scalar e_a_reading{};  ///< [V] terminal voltage, as predicted from the reference

  /// [V], [A] Over the last step; known where they are asked for.
  const MeanReadings<Scalar>& means() const { return means_; }
  void ask_for_means() { means_asked_ = true; }

  /// Those of now; good until the next step.
  SimulatedReadings<Scalar> readings() const {
    return {e_a_reading, i_a_reading(), omega_reading(), sensors_.theta_reading(angle_), sensors_.torque_reading};
  }
  const Scalar& omega_reading() const { return sensors_.omega_reading; }
  const Scalar& i_a_reading() const { return sensors_.i_a_reading; }

  /// Makes it turn, and be read, at a speed.
  void turn_at(const Scalar& speed) { omega = sensors_.omega_reading = speed; }

  /// [rad] of the shaft.
  const Scalar& angle() const { return angle_.theta(); }

  /// [V] What a measured voltage adds to that of the driver in the next step: the driver says how it goes on within.
  void add_measured(const Ramp<Scalar>& added) { added_ = added; }

  /// The driver as it stands.
  const Driver<Scalar>& driver() const { return driver_; }

  /// Moves a copy of it on, over a step to come.
  void look_ahead(Driver<Scalar>& ahead, double u_ref, double t, double h) {
    equations_.middle.t = t + 0.5 * h;
    equations_.middle.h = h;
    ahead.follow(u_ref, t, h, equations_);
  }

  double driver_moved_for() const { return driver_.moved_for(); }  ///< [s] of the last step; then it stood still

  /// [A] What a rise of the speed takes of the current, at a steady voltage and without an inductance.
  Scalar current_taken_by(const Scalar& rise) const { return armature_.end().v1 * armature_.k_b() * rise; }

 private:
  using Motion<Scalar>::i_a_before, Motion<Scalar>::omega_before;
  using Motion<Scalar>::i_a_in_middle, Motion<Scalar>::omega_in_middle;

  /// @param driven what the driver does @param e the voltage at the terminals
  void step_in_general(const StepInput& in, const Ramp<Scalar>& driven, Ramp<Scalar> e, double h) {
    const Circuit circuit = close_circuit(in, h, value_of(driven.mean()), e);

    // Both voltages across R and L, but for what the speed at the end takes; then the speed; then the current.
    const Scalar v0 = e.start - armature_.k_b() * omega;
    const Scalar mean_current = circuit == Circuit::closed ? armature_.mean_current(v0, e.end, i_a)
                                                           : Scalar(circuit == Circuit::driven ? in.i_a : 0.0);
    const ShaftTorque<Scalar> torque = torque_on_shaft(in, mean_current, circuit, e);
    const Scalar omega_end =
        is_there_.bristle ? shaft_.speed_on_bristles(omega, torque, h) : shaft_.speed_after(omega, torque);

    i_a_before = i_a;
    if (circuit == Circuit::closed) {
      i_a = is_there_.reaction && !armature_.inductive()
                ? reacting_current(armature_.end().v1, e.end, equations_.p[base::K_b] * full_flux_ * omega_end, i_a,
                                   equations_.terms)
                : armature_.end_current(v0, e.end - armature_.k_b() * omega_end, i_a);
    } else {
      i_a = mean_current;
    }
    const Scalar back_emf = armature_.k_b() * omega_end;
    e_a_reading = circuit == Circuit::blocked ? back_emf : driver_.terminal_voltage(equations_.terms, i_a, back_emf);
    if (is_there_.current_limit && circuit == Circuit::closed) e_a_reading -= source_.withheld();
    omega_before = omega;
    omega = omega_end;
    if (!means_asked_) return;
    means_.i_a = mean_current - armature_.mean().v1 * back_emf;
    means_.e_a =
        driven.mean() + e_a_reading - driver_.voltage() + equations_.terms.output_resistance * (i_a - means_.i_a);
  }

  /// The same where it is linear, multiplied out.
  /// @param start, end [V] at the terminals
  template <class Voltage>
  void step_linearly(const Voltage& start, const Voltage& end, double h) {
    solve_linear_step(h);
    omega_before = omega;
    i_a_before = i_a;
    omega = linear_.omega_end_under(braking_beside_steady(), omega_before, i_a_before, start, end);
    i_a = linear_.i_a_end(omega_before, i_a_before, start, end, omega);
    e_a_reading = driver_.voltage_under(equations_.terms, i_a);
  }

  /// What effects that only brake do in the step.
  Braking<Scalar> braking_beside_steady() const {
    return {equations_.terms.braking_torque - steady_braking_.torque,
            equations_.terms.dry_friction - steady_braking_.dry_friction};
  }

  void solve_linear_step(double h) {
    if (h == linear_h_) return;
    solve_for(h, true);
    linear_ = LinearStep<Scalar>(armature_, shaft_, equations_.terms, steady_braking_);
    linear_h_ = h;
  }

  /// The voltage at the terminals over a step.
  Ramp<Scalar> terminals(const StepInput& in, const Ramp<Scalar>& driven) const {
    if (!structure_.measured_voltage) return driven;
    if (!added_) return {Scalar(2 * in.e_a_mean - in.e_a_end), Scalar(in.e_a_end)};
    const Scalar end = driver_.voltage() + added_->end;
    return {2.0 * (driven.mean() + added_->mean()) - end, end};
  }

  /// The state in the middle of the step, extrapolated from the last one: what the effects see.
  void look_at_middle(const StepInput& in, double t, double h) {
    State<Scalar>& x = equations_.middle;
    x.t = t + 0.5 * h;
    x.field_on = field_on_ + x.t;
    x.h = h;
    x.u_ref = in.u_ref;
    x.e_a = driver_.voltage();
    x.i_a = i_a_in_middle();
    x.omega = omega_in_middle();
    x.omega_start = omega;
    x.temperature = in.temperature;
    angle_.see_in_middle(in, h, omega, x);
  }

  /// Driver: u_ref -> e_a. What follows takes the voltage as linear over the step, with the right mean and end.
  Ramp<Scalar> drive(double u_ref, double t, double h) {
    if (structure_.input != Signal::u_ref) return {driver_.voltage(), driver_.voltage()};
    const Scalar mean = driver_.follow(u_ref, t, h, equations_);
    return {2.0 * mean - driver_.voltage(), driver_.voltage()};
  }

  /// What the effects add to the equations of the motor and its load: once, where that stays.
  void gather_motor_terms(const StepInput& in) {
    Balance<Scalar>& terms = equations_.terms;
    if (is_gathered_) {  // but for what the last step made of it
      terms.load_torque = steady_load_;
      if (is_there_.reaction) terms.flux = full_flux_;
      return motor_.brake(steady_braking_, equations_);
    }
    reset_motor(equations_);
    is_steady_ ? motor_.apply_others(equations_.middle, equations_) : motor_.apply(equations_.middle, equations_);
    user_.apply(equations_);
    if (structure_.measured_load) equations_.middle.omega = speed_as_read_.in_middle(in.omega);
    if (!load_.empty())
      load_.apply(terms.behind_spring.seen_in_middle(equations_.middle, omega_in_middle()), equations_);
    is_there_ = terms_in(terms);
    steady_load_ = terms.load_torque;
    steady_braking_ = {terms.braking_torque, terms.dry_friction};
    full_flux_ = terms.flux;
    is_gathered_ = is_steady_;
    if (!is_gathered_) return;
    equations_.middle.omega = omega_in_middle();
    motor_.brake(steady_braking_, equations_);
    solved_h_ = linear_h_ = 0;
    is_linear_ = is_there_ == TermsThere{} && !terms.one_quadrant && !terms.lets_go && !structure_.measured_load &&
                 structure_.input != Signal::i_a;
  }

  /// Armature circuit and air gap. What depends on the current that is left at the step's end bends the voltages first.
  /// @param driven [V] mean of what the driver does @param e [V] at the terminals; in, out
  Circuit close_circuit(const StepInput& in, double h, double driven, Ramp<Scalar>& e) {
    const Circuit circuit = in.armature_open                  ? Circuit::open
                            : structure_.input == Signal::i_a ? Circuit::driven
                                                              : Circuit::closed;
    const bool conducts = circuit == Circuit::closed;
    if (is_there_.reaction) weaken_flux(in, circuit, h, e);
    solve_for(h, conducts);
    const bool without_pulse = conducts && !structure_.measured_voltage &&
                               source_.bend(e, user_.voltage(), *this, armature_, equations_.terms, is_there_);
    if (is_there_.current_limit && structure_.measured_voltage) {  // which is what it gave
      source_.limit(driver_.voltage() - equations_.terms.output_resistance * i_a, user_.voltage(), *this, armature_,
                    equations_.terms);
    }
    // A measured voltage is the motor's own while the driver blocks: the driver tells.
    const bool follows_driver = structure_.input == Signal::u_ref;
    const Scalar source = (follows_driver ? Scalar(driven) : e.mean()) + user_.voltage();
    const bool asked = follows_driver ? driver_.asked() != 0 : in.e_a_mean != 0 || in.e_a_end != 0;
    if (conducts && (without_pulse || blocks(structure_.driver, equations_.terms, armature_, *this, source, asked))) {
      equations_.terms.flux = full_flux_;
      solve_for(h, false);
      user_.set_voltage(Scalar(0.0));
      return Circuit::blocked;
    }
    if (conducts && is_there_.contact_drop) {
      contact_drop_ = armature_.contact_drop(e.mean() + user_.voltage(), *this, equations_.terms);
      e -= contact_drop_;
    }
    if (user_.any_voltage()) {
      user_.set_voltage(conducts ? user_.voltage_for(e.mean(), armature_, *this, equations_) : Scalar(0.0));
      e += user_.voltage();
    }
    return circuit;
  }

  /// Takes from the flux what the mean current of the step does; the brushes still drop what they did.
  void weaken_flux(const StepInput& in, Circuit circuit, double h, const Ramp<Scalar>& e) {
    Balance<Scalar>& terms = equations_.terms;
    if (circuit == Circuit::driven) terms.flux *= flux_left(terms, Scalar(in.i_a));
    if (circuit != Circuit::closed) return;
    if (h != solved_h_ || !solved_conducts_ || any(armature_.circuit_changed(resistance(), terms))) solve_for(h, true);
    const Scalar lost = contact_drop_ + source_.withheld();
    const Scalar pushed = armature_.mean_current(e.start - lost, e.end - lost, i_a);
    const Scalar taken =
        (armature_.mean().v0 + armature_.mean().v1) * equations_.p[base::K_b] * full_flux_ * omega_in_middle();
    terms.flux *= flux_left(terms, current_under_reaction(pushed - taken, taken, value_of(i_a), terms));
  }

  /// [ohm] Of the circuit: a driver's own is in a row with the motor's.
  Scalar resistance() const {
    const Balance<Scalar>& terms = equations_.terms;
    return structure_.measured_voltage ? terms.resistance : terms.resistance + terms.output_resistance;
  }

  /// Prepares what a step multiplies by.
  void solve_for(double h, bool conducts) {
    const Scalar resistance = this->resistance();
    if (h == solved_h_ && conducts == solved_conducts_) {
      const bool stays = is_gathered_ && !is_there_.reaction;
      if (stays || !any(armature_.changed(resistance, equations_.terms) | shaft_.changed(equations_.terms))) return;
    }
    solved_h_ = h;
    solved_conducts_ = conducts;
    linear_h_ = 0;
    armature_.solve(resistance, equations_, h, conducts);
    shaft_.solve(armature_, equations_.terms, h);
  }

  /// But for viscous friction and what the speed at the end of the step takes from the current.
  ShaftTorque<Scalar> torque_on_shaft(const StepInput& in, const Scalar& mean_current, Circuit circuit,
                                      const Ramp<Scalar>& e) {
    const Balance<Scalar>& terms = equations_.terms;
    ShaftTorque<Scalar> torque{armature_.k_m() * mean_current - terms.braking_torque, terms.dry_friction, Scalar(0.0),
                               terms.bristle};
    if (circuit == Circuit::closed) torque.pull += shaft_.late() * (e.end - e.start);
    if (is_there_.gear_friction) torque.dry_friction += terms.gear_friction * abs(torque_in_gears(in, mean_current));
    if (terms.behind_spring.there) {
      braked_ = take_behind_spring(equations_.terms, measured_load(in), omega_in_middle());
      torque.pull -= terms.behind_spring.felt();
      return torque;
    }
    ShaftTorque<Scalar> foretold = torque;  // with the load as its effects say
    foretold.pull -= terms.load_torque;
    foretold.brake = terms.brake;
    braked_ = is_there_.brake ? shaft_.braked(omega, foretold) : Scalar(0.0);
    if (!structure_.measured_load) return foretold;
    torque.take_load(*measured_load(in), terms.load_torque, omega);
    // While a brake holds, the gauge reads what pulls, and its noise would let go of a shaft that the brake holds.
    if (std::abs(value_of(braked_)) < value_of(terms.brake)) torque.brake = larger(torque.brake, terms.brake);
    return torque;
  }

  /// [N m] What motor and load lay on the gears between them, by an extrapolated speed at the end of the step.
  Scalar torque_in_gears(const StepInput& in, const Scalar& mean_current) const {
    const Scalar current = mean_current - armature_.mean().v1 * armature_.k_b() * this->omega_at_end();
    const Balance<Scalar>& terms = equations_.terms;
    return armature_.k_m() * current + measured_load(in).value_or(terms.load_torque + braked_);
  }

  /// [N m] What the gauge says of the load, where that loads the shaft.
  std::optional<Scalar> measured_load(const StepInput& in) const {
    if (!structure_.measured_load) return std::nullopt;
    return in.load - equations_.terms.load_offset;
  }

  /// What the load takes at the end of the step, which is when the gauge is read, not half a step before.
  void look_at_load(const StepInput& in, double t) {
    if (load_.empty()) return;
    if (is_gathered_) {
      equations_.terms.load_torque += braked_;
      return;
    }
    equations_.terms.load_torque = Scalar(0.0);
    State<Scalar> end{.t = t, .field_on = field_on_ + t, .u_ref = in.u_ref, .e_a = driver_.voltage(), .i_a = i_a};
    end.omega = structure_.measured_load ? speed_as_read_.at_end(in.omega_end) : omega;
    angle_.see_at_end(in, end);
    load_.apply(equations_.terms.behind_spring.seen_at_end(end, 0.5 * (omega_before + omega), omega), equations_);
    equations_.terms.load_torque += braked_;
  }

  void read_sensors(double t, double h, const StepInput& in) {
    sensors_.read(in, t, h, *this, structure_.measured_voltage ? Scalar(in.e_a_end) : e_a_reading, angle_, equations_);
    if (!sensors_.read_the_state()) speed_as_read_.follow(sensors_.omega_reading, omega, h == 0);
  }

  const ModelStructure& structure_;
  Equations<Scalar> equations_;
  Driver<Scalar> driver_;
  Armature<Scalar> armature_;
  Shaft<Scalar> shaft_;
  RotorAngle<Scalar> angle_;
  MotorParts<Scalar> motor_;
  EffectParts<Scalar> load_;
  Sensors<Scalar> sensors_;
  SpeedAsRead<Scalar> speed_as_read_;
  UserTerms<Scalar> user_;
  std::optional<Ramp<Scalar>> added_;  ///< [V] by a measured voltage to the driver's, in the next step
  Scalar steady_load_{};               ///< [N m] of the load; the same in every step
  Braking<Scalar> steady_braking_;     ///< of effects that do more than brake; the same in every step
  Scalar full_flux_{};                 ///< [1] before the armature's own field weakens it
  SourceUnderLoad<Scalar> source_;
  Scalar contact_drop_{};  ///< [V] of the brushes, over the last step
  Scalar braked_{};        ///< [N m] by a brake of the load, over the last step
  bool means_asked_ = false;
  MeanReadings<Scalar> means_;
  double field_on_ = 0;  ///< [s] for which the field had been on at the start
  double solved_h_ = 0;  ///< [s] the step that armature and shaft are solved for
  bool solved_conducts_ = false;
  bool is_steady_ = false;    ///< all effects but the sensors' and those that only brake add the same in every step
  bool is_gathered_ = false;  ///< and were asked for it
  TermsThere is_there_;
  bool is_linear_ = false;  ///< all of it but dry friction is linear and stays from step to step
  LinearStep<Scalar> linear_;
  double linear_h_ = 0;  ///< [s] that this is for
};

}  // namespace emtb
