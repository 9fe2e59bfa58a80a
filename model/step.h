#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <limits>
#include <numbers>
#include <optional>
#include <span>
#include <vector>

#include "model/catalogue.h"
#include "model/dual.h"
#include "model/effect.h"
#include "model/simulation.h"
#include "model/slew.h"
#include "model/structure.h"

namespace emtb {

/// What drives one step, from the data or from the stage above.
struct StepInput {
  double u_ref = 0;      ///< [V] held over the step
  double e_a_mean = 0;   ///< [V] terminal voltage, over the step; used where the structure says `measured_voltage`
  double e_a_end = 0;    ///< [V]
  double i_a = 0;        ///< [A] of a current drive, held over the step
  double load = 0;       ///< [N m] measured load torque, mean over the step: a passive load
  double omega = 0;      ///< [rad/s] measured speed in the middle: predicts the load where `measured_load`
  double omega_end = 0;  ///< [rad/s] the same at the end, where the gauge is read
  std::optional<double> angle_middle, angle_end;  ///< [rad] measured: what periodic effects see; absent: as simulated
  std::optional<double> angle_pull;               ///< [1/s] see Excitation::angle_pull
  bool angle_integrated = false;                  ///< see Excitation::angle_integrated
  double temperature = std::numeric_limits<double>::quiet_NaN();  ///< [degC] where measured
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
///  - the shaft by the trapezoidal rule, fitted to its own decay; dry friction by an implicit soft threshold, so that
///  the shaft sticks exactly, and the voltage that brushes drop alike;
///  - what the effects contribute at the extrapolated middle of the step.
///
/// Divisions and the exponential depend on R_a, L_a, K_b, K_m, B, J and h only; they are kept until one of these
/// changes.
template <class Scalar>
class Machine {
 public:
  /// @param p all parameters of the structure, in its order, and optionally one more: an angle to add to that of the
  /// rotor at the start; must outlive the machine
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
    }
    for (const PlacedTerm& term : structure.terms) {
      (term.place == TermPlace::voltage ? voltages_of_user_ : terms_of_user_).push_back({&term, parameter});
      parameter += term.parameter_count;
    }
    if (p.size() > parameter) turned_ = p[parameter];
    memory_.resize(memory);
    reset_driver_terms();
    reset_motor_terms();
  }

  /// Goes on with other parameters, in place of those it was made with.
  void follow(std::span<const Scalar> p) { p_ = p; }

  /// Puts the machine into its state at the start of a run, and takes the first readings.
  void start(const InitialState& initial, const StepInput& input) {
    field_on_ = initial.field_on;
    omega = omega_before_ = Scalar(initial.omega);
    theta = turned_ + initial.theta;
    lead_ = Scalar(0.0);
    period_ = shortest_period();
    angle_before_ = Scalar(input.angle_end.value_or(0));
    behind_ = Scalar(0.0);
    i_a = i_a_before_ = Scalar(initial.i_a);
    changes_ = {{-infinity, input.u_ref}};
    e_driver = e_slewed_ = initial.e_driver ? Scalar(*initial.e_driver) : target_of(input.u_ref);
    e_a_reading = e_driver - terms_.output_resistance * i_a;
    middle_ = {.u_ref = input.u_ref, .e_a = e_driver, .i_a = i_a, .omega = omega, .theta = theta};
    if (structure_.measured_load) middle_.omega = Scalar(input.omega);
    apply(load_parts_, middle_);
    read_sensors(0, 0, input);
    if (!initial.as_read) return;
    if (initial.omega != 0) omega = omega_before_ = initial.omega - (omega_reading - omega);
    if (initial.i_a != 0) i_a = i_a_before_ = initial.i_a - (i_a_reading - i_a);
    read_sensors(0, 0, input);
  }

  /// Advances from t to t + h.
  void step(const StepInput& in, double t, double h) {
    if (!structure_.effects.empty() || !structure_.terms.empty()) look_at_middle(in, t, h);

    // Driver: u_ref -> e_a. What follows takes the voltage as linear over the step, with the right mean and end.
    Scalar e0 = e_driver;
    if (structure_.input == Signal::u_ref) {
      const Scalar mean = follow_reference(in.u_ref, t, h);
      e0 = 2.0 * mean - e_driver;
    }
    Scalar e1 = e_driver;
    const bool follows_driver = structure_.input == Signal::u_ref;
    const double driven = value_of(0.5 * (e0 + e1));
    if (structure_.measured_voltage) {
      e0 = Scalar(2 * in.e_a_mean - in.e_a_end);
      e1 = Scalar(in.e_a_end);
    }

    // What the effects add to the equations of the motor and its load.
    if (!motor_parts_.empty() || !load_parts_.empty() || !terms_of_user_.empty()) {
      reset_motor_terms();
      apply(motor_parts_, middle_);
      for (const UserTerm& term : terms_of_user_) apply(term);
      if (structure_.measured_load) middle_.omega = Scalar(in.omega);
      apply(load_parts_, middle_);
    }

    // Armature circuit and air gap: the current is linear in the voltages across R and L at both ends of the step.
    bool conducts = !in.armature_open && structure_.input != Signal::i_a;
    solve_for(h, conducts);
    if (conducts && !structure_.measured_voltage && any(differs(terms_.light_load_rise, Scalar(0.0)))) {
      const Scalar rise = light_load_rise(0.5 * (e0 + e1) + added_);
      e0 += rise;
      e1 += rise;
    }
    // A measured voltage is the motor's own while the driver blocks, give or take noise: what the driver would do
    // tells.
    const Scalar source = follows_driver ? Scalar(driven) : 0.5 * (e0 + e1);
    const bool blocked = conducts && terms_.one_quadrant && value_of(stopping_voltage(source + added_)) <= 0;
    if (blocked) solve_for(h, conducts = false);
    if (conducts && any(differs(terms_.contact_drop, Scalar(0.0)))) {
      const Scalar drop = contact_drop(0.5 * (e0 + e1) + added_);
      e0 -= drop;
      e1 -= drop;
    }
    if (!voltages_of_user_.empty()) {
      added_ = conducts ? added_voltage(0.5 * (e0 + e1)) : Scalar(0.0);
      e0 += added_;
      e1 += added_;
    }
    const Scalar v0 = e0 - k_b_ * omega;
    Scalar mean_current(
        in.armature_open || blocked ? 0.0 : in.i_a);  // over the step, less what the speed at its end will add
    if (conducts) {
      mean_current = mean_.v0 * v0 + mean_.v1 * e1;
      if (inductive_) mean_current += mean_.i * i_a;
    }

    // Shaft and load: trapezoidal, dry friction implicit.
    Scalar torque = k_m_ * mean_current - terms_.braking_torque;
    if (conducts) torque += late_ * (e1 - e0);
    Scalar dry_friction = terms_.dry_friction;
    if (!structure_.measured_load) {
      torque -= terms_.load_torque;
    } else {
      // What the load effects say of it pulls as they do, as far as the gauge shows it; the rest is a brake's, which
      // takes torque but does not push: at rest it holds.
      const Scalar load = in.load - terms_.load_offset;
      const bool all = value_of(load) == 0 || value_of(terms_.load_torque) / value_of(load) > 1;
      const Scalar pulls = all ? load : terms_.load_torque, rest = load - pulls;
      if (value_of(rest) * value_of(omega) >= 0) {
        torque -= pulls;
        dry_friction += abs(rest);
      } else {
        torque -= load;
      }
    }
    const Scalar omega_end = soft_threshold(momentum_ * omega + torque, dry_friction) * inverse_inertia_;

    i_a_before_ = i_a;
    if (conducts) {
      const Scalar v1 = e1 - k_b_ * omega_end;
      i_a = inductive_ ? end_.v0 * v0 + end_.v1 * v1 + end_.i * i_a : end_.v1 * v1;
    } else {
      i_a = mean_current;
    }
    e_a_reading = blocked ? k_b_ * omega_end : output_voltage();
    const Scalar turned = 0.5 * h * (omega + omega_end);
    theta += turned;
    if (in.angle_end) {
      const Scalar angle = *in.angle_end + behind_;
      if (in.angle_pull && period_ > 0) {
        lead_ = (lead_ + turned - (angle - angle_before_)) * (1 / (1 + h * *in.angle_pull));
        lead_ -= period_ * std::round(value_of(lead_) / period_);  // another tooth is as good
      }
      angle_before_ = angle;
    }
    omega_before_ = omega;
    omega = omega_end;
    look_at_load(in, t + h);
    read_sensors(t + h, h, in);
  }

  Scalar e_driver{};     ///< [V] what the driver makes of the reference, before its load takes a part
  Scalar e_a_reading{};  ///< [V] terminal voltage, as predicted from the reference
  Scalar i_a{};          ///< [A]
  Scalar omega{};        ///< [rad/s]
  Scalar theta{};        ///< [rad]
  Scalar omega_reading{};
  Scalar i_a_reading{};
  Scalar torque_reading{};  ///< [N m] what the load effects take, from the speed of the model

  /// Those of now; good until the next step.
  SimulatedReadings<Scalar> readings() const {
    return {e_a_reading, i_a_reading, omega_reading, theta, torque_reading};
  }

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
    middle_.field_on = field_on_ + middle_.t;
    middle_.h = h;
    middle_.u_ref = in.u_ref;
    middle_.e_a = e_driver;
    middle_.i_a = i_a + 0.5 * (i_a - i_a_before_);
    middle_.omega = omega + 0.5 * (omega - omega_before_);
    middle_.omega_start = omega;
    middle_.theta = !in.angle_middle ? theta + 0.5 * h * omega
                    : in.angle_pull  ? turned_ + angle_before_ + lead_ + 0.5 * h * omega
                                     : turned_ + *in.angle_middle + behind_;
    middle_.temperature = in.temperature;
  }

  /// [rad] Of what repeats with the angle; 0 where nothing does.
  double shortest_period() const {
    double most = 0;  // times a turn
    std::size_t place = ModelStructure::base_count;
    for (const std::size_t effect : structure_.effects) {
      const EffectInfo& info = effect_catalogue()[effect];
      const auto order = info.place_of(Role::order);
      if (info.periodic) most = std::max({most, 1.0, order ? value_of(p_[place + *order]) : 1.0});
      place += info.parameter_count;
    }
    return most > 0 ? 2 * std::numbers::pi / most : 0;
  }

  /// The driver as known; effects of the driver change it in every step.
  void reset_driver_terms() {
    const DriverModel& d = structure_.driver;
    terms_.gain = Scalar(d.gain);
    terms_.min = Scalar(d.min);
    terms_.max = Scalar(d.max);
    terms_.rise = Scalar(d.rise);
    terms_.fall = Scalar(d.fall);
    terms_.delay = terms_.offset = terms_.lag = Scalar(0.0);
    terms_.output_resistance = terms_.light_load_rise = terms_.light_load_current = Scalar(0.0);
    terms_.one_quadrant = false;
  }

  /// The motor of the base model; effects of armature, air gap, shaft and load change it in every step.
  void reset_motor_terms() {
    terms_.resistance = p_[0];
    terms_.viscous = p_[3];
    terms_.inertia = p_[4];
    terms_.gap = Scalar(0.0);
    terms_.flux = Scalar(1.0);
    terms_.inductance = terms_.contact_drop = terms_.contact_knee = Scalar(0.0);
    terms_.braking_torque = terms_.load_torque = terms_.dry_friction = Scalar(0.0);
  }

  struct UserTerm {
    const PlacedTerm* placed;
    std::size_t parameter;
  };

  /// A user's term at a state, with all derivatives; by_current: by the current alone.
  Scalar value_at(const UserTerm& term, const State<Scalar>& x, double& by_current) {
    const TermInput at{value_of(x.omega), value_of(x.i_a), value_of(x.theta), x.u_ref, x.t};
    const std::size_t count = term.placed->parameter_count;
    term_values_.resize(count);
    by_parameter_.resize(count);
    for (std::size_t i = 0; i < count; ++i) term_values_[i] = value_of(p_[term.parameter + i]);
    TermInput by{};
    const double value = term.placed->term->evaluate(at, term_values_, by, by_parameter_);
    Scalar sum(value);
    if (by.omega != 0) sum += by.omega * (x.omega - at.omega);
    if (by.i_a != 0) sum += by.i_a * (x.i_a - at.i_a);
    if (by.theta != 0) sum += by.theta * (x.theta - at.theta);
    for (std::size_t i = 0; i < count; ++i) {
      if (by_parameter_[i] != 0) sum += by_parameter_[i] * (p_[term.parameter + i] - term_values_[i]);
    }
    by_current += by.i_a;
    return sum;
  }

  void apply(const UserTerm& term) {
    double by_current = 0;
    const Scalar value = value_at(term, middle_, by_current);
    if (term.placed->place == TermPlace::torque) {
      terms_.braking_torque -= value;
    } else {
      terms_.flux *= value;
    }
  }

  /// What the user's terms add to the armature's voltage, for the current that is left at the end of the step:
  /// implicit, since without an inductance the current follows at once, and a drop that is steep in it would swing.
  /// Newton's steps between bounds on a function that grows; the last one carries the derivatives.
  /// @param e [V] mean over the step
  Scalar added_voltage(const Scalar& e) {
    const Scalar stopping = stopping_voltage(e), resistance = stopping_resistance();
    State<Scalar> x = middle_;
    x.omega = omega + 0.5 * (omega - omega_before_);  // a measured one is for the load alone
    Scalar sum(0.0);
    double v = value_of(added_), slope = 1, low = -infinity, high = infinity;
    for (int n = 0; n < 60; ++n) {
      x.i_a = (stopping + v) / resistance;
      sum = Scalar(0.0);
      double by_current = 0;
      for (const UserTerm& term : voltages_of_user_) sum += value_at(term, x, by_current);
      slope = 1 - by_current / value_of(resistance);
      const double gap = v - value_of(sum);
      if (!(slope > 0) || !std::isfinite(gap)) {  // a source that outgrows its own current: explicit
        slope = 1;
        v = value_of(sum);
        break;
      }
      if (std::abs(gap) <= 1e-13 * (std::abs(v) + std::abs(value_of(stopping)))) break;
      (gap > 0 ? high : low) = v;
      double next = v - gap / slope;
      if (!(next > low && next < high)) next = std::isfinite(high - low) ? 0.5 * (low + high) : v - gap;
      if (next == v) break;
      v = next;
    }
    return v + (sum - value_of(sum)) * (1 / slope);  // where the voltage jumps, v is what holds the current there
  }

  void apply(const Parts& parts, const State<Scalar>& x) {
    for (const Part& part : parts) {
      part.apply(p_.subspan(part.parameter, part.parameters), std::span(memory_).subspan(part.memory, part.memories), x,
                 terms_);
    }
  }

  /// What the driver makes of a reference in the end.
  Scalar target_of(double u_ref) {
    reset_driver_terms();
    terms_.u = Scalar(u_ref);
    middle_.u_ref = u_ref;
    apply(driver_parts_, middle_);
    return clamped(terms_.gain * terms_.u + terms_.offset, terms_.min, terms_.max);
  }

  /// Moves the driver's output over a step. @return its mean
  Scalar follow_reference(double u_ref, double t, double h) {
    const DriverModel& d = structure_.driver;
    if (driver_parts_.empty()) {  // all is known, nothing has a derivative
      const double target = clamped(d.gain * u_ref, d.min, d.max);
      const Slewed<double> e = slew(value_of(e_driver), target, d.rise, d.fall, h);
      e_driver = Scalar(e.end);
      return Scalar(e.mean);
    }
    if (u_ref != changes_.back().u_ref) changes_.push_back({t, u_ref});
    // The references that arrive during the step, each from its change on; the delay is what moves them.
    Scalar area(0.0), from(0.0);
    const auto drive = [&](double u, const Scalar& until) {
      const Scalar target = target_of(u);
      const Slewed<Scalar> e = slew(e_slewed_, target, terms_.rise, terms_.fall, until - from);
      e_slewed_ = e.end;
      area += e.mean * (until - from);
      from = until;
    };
    while (arrived_ + 1 < changes_.size() && changes_[arrived_ + 1].t + value_of(terms_.delay) < t + h) {
      drive(changes_[arrived_].u_ref, (changes_[arrived_ + 1].t - t) + terms_.delay);
      ++arrived_;
    }
    drive(changes_[arrived_].u_ref, Scalar(h));
    forget_references();
    const Scalar mean = area / h, before = e_driver;
    if (!any(differs(terms_.lag, Scalar(0.0)))) {
      e_driver = e_slewed_;
      return mean;
    }
    e_driver = first_order_lag(terms_.lag, h, 2.0 * mean - e_slewed_, e_slewed_, before);
    return mean - terms_.lag * (e_driver - before) / h;
  }

  /// A reference that changes all the time would fill the memory of a machine that runs all day.
  void forget_references() {
    constexpr std::size_t many = 4096;
    if (arrived_ < many) return;
    changes_.erase(changes_.begin(), changes_.begin() + static_cast<std::ptrdiff_t>(arrived_));
    arrived_ = 0;
  }

  /// The voltage that is left for a current at the end of the step, counted so that 0 leaves none.
  /// @param e [V] mean over the step
  Scalar stopping_voltage(const Scalar& e) const {
    const Scalar left = e - k_b_ * (omega + 0.5 * (omega - omega_before_));
    return inductive_ ? left + holding_ * i_a : left;
  }

  /// [ohm] what a current at the end of the step costs of that voltage, per ampere.
  Scalar stopping_resistance() const { return inductive_ ? solved_.resistance + holding_ : solved_.resistance; }

  /// What the output of a rectifier rises by as the current gets gaps: V exp(-i/i_c), implicit. Newton's steps from
  /// below on a concave function.
  Scalar light_load_rise(const Scalar& e) const {
    if (value_of(e) <= 0) return Scalar(0.0);
    const Scalar stopping = stopping_voltage(e), knee = stopping_resistance() * terms_.light_load_current;
    const double s = value_of(stopping), k = value_of(knee), v = value_of(terms_.light_load_rise);
    double rise = 0;
    for (int n = 0; n < 30; ++n) {
      const double gone = v * std::exp(-std::max(0.0, s + rise) / k);
      const double slope = s + rise > 0 ? gone / k : 0;
      const double change = (gone - rise) / (1 + slope);
      rise += change;
      if (std::abs(change) < 1e-13 * v) break;
    }
    const Scalar gone = terms_.light_load_rise * exp(-larger(stopping + rise, Scalar(0.0)) / knee);
    const Scalar slope = s + rise > 0 ? gone / knee : Scalar(0.0);
    return rise + (gone - rise) / (1.0 + slope);
  }

  /// The driver's terminal voltage, which its own load bends.
  Scalar output_voltage() const {
    if (driver_parts_.empty()) return e_driver;
    Scalar e = e_driver - terms_.output_resistance * i_a;
    if (any(differs(terms_.light_load_rise, Scalar(0.0))) && value_of(e_driver) > 0) {
      e += terms_.light_load_rise * exp(-abs(i_a) / terms_.light_load_current);
    }
    return e;
  }

  /// What the brushes take of the voltage: V tanh(i/i_knee), for the current that is left at the end of the step.
  /// Implicit, since the knee is steep.
  /// @param e [V] mean over the step
  Scalar contact_drop(const Scalar& e) const {
    const Scalar stopping = stopping_voltage(e), knee = stopping_resistance() * terms_.contact_knee;
    // Newton's steps from above on a convex function: they cannot overshoot. The last one carries the derivatives.
    const double s = value_of(stopping), k = value_of(knee), v = value_of(terms_.contact_drop);
    double drop = clamped(s * v / (k + v), -v, v);
    for (int n = 0; n < 20; ++n) {
      const double bend = saturation((s - drop) / k);
      const double change = (drop - v * bend) / (1 + v / k * (1 - bend * bend));
      drop -= change;
      if (std::abs(change) < 1e-13 * v) break;
    }
    const Scalar bend = saturation((stopping - drop) / knee);
    return drop - (drop - terms_.contact_drop * bend) / (1.0 + terms_.contact_drop / knee * (1.0 - bend * bend));
  }

  /// Prepares what a step multiplies by.
  void solve_for(double h, bool conducts) {
    const Balance<Scalar>& b = terms_;
    const Scalar resistance =
        structure_.measured_voltage ? b.resistance : b.resistance + b.output_resistance;  // in a row with the motor's
    const bool changed = any(differs(resistance, solved_.resistance) | differs(b.inertia, solved_.inertia) |
                             differs(b.inductance, solved_.inductance) | differs(b.flux, solved_.flux) |
                             differs(b.viscous, solved_.viscous));
    if (h == solved_h_ && conducts == solved_conducts_ && !changed) return;
    solved_h_ = h;
    solved_conducts_ = conducts;
    solved_ = {resistance, b.inductance, b.flux, b.viscous, b.inertia};
    k_b_ = p_[1] * b.flux;
    k_m_ = p_[2] * b.flux;
    mean_ = end_ = Response{};
    inductive_ = any(differs(b.inductance, Scalar(0.0)));
    if (conducts) {
      // R i + L di/dt = v, v linear from v0 to v1: i(h) = v1/R - trail + (i - v0/R + trail) carried, trail = (v1 - v0)
      // lag/R.
      const Scalar conductance = 1.0 / resistance;
      Scalar lag(0.0), carried(0.0);  // L/R in steps; how much of an initial current is left at the end
      if (inductive_) {
        const Scalar tau = b.inductance * conductance;
        lag = tau / h;
        carried = decay(h, tau);
        holding_ = carried / (1.0 - carried) * resistance;
      }
      const Scalar mean_carried = lag * (1.0 - carried);
      end_ = {(mean_carried - carried) * conductance, (1.0 - mean_carried) * conductance, carried};
      const Scalar late = lag * (1.0 - mean_carried);
      mean_ = {(0.5 + late - mean_carried) * conductance, (0.5 - late) * conductance, mean_carried};
    }
    // With J/h the trapezoidal rule lets the speed decay by (J/h - d)/(J/h + d), where d is half of what damps it; with
    // J/h + d²h/(3J) that is the [2/2] Padé approximant of the exponential: fourth order, and never past zero. A torque
    // that grows over the step then counts more at its end, from which less has decayed.
    const Scalar inertia = b.inertia / h;
    const Scalar conductance = mean_.v0 + mean_.v1;
    const Scalar damping = 0.5 * (b.viscous + k_m_ * k_b_ * conductance);
    late_ = k_m_ * conductance * damping / (6.0 * inertia);
    const Scalar fitted = inertia + damping * damping / (3.0 * inertia);
    momentum_ = fitted - 0.5 * b.viscous;
    inverse_inertia_ = 1.0 / (fitted + 0.5 * b.viscous + k_m_ * k_b_ * mean_.v1);
  }

  /// What the load takes at the end of the step, which is when the gauge is read: half a step of 1 ms later a weight
  /// off centre stands 0.25 rad further at 500 rad/s.
  void look_at_load(const StepInput& in, double t) {
    if (load_parts_.empty()) return;
    terms_.load_torque = Scalar(0.0);
    apply(load_parts_, {.t = t,
                        .field_on = field_on_ + t,
                        .h = 0,
                        .u_ref = in.u_ref,
                        .e_a = e_driver,
                        .i_a = i_a,
                        .omega = structure_.measured_load ? Scalar(in.omega_end) : omega,
                        .theta = angle_at_end(in)});
  }

  /// As what repeats with it sees it.
  Scalar angle_at_end(const StepInput& in) const {
    return in.angle_end ? turned_ + *in.angle_end + behind_ + lead_ : theta;
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
    terms_.load_offset = terms_.angle_behind = Scalar(0.0);
    apply(sensor_parts_,
          {.t = t, .h = h, .u_ref = in.u_ref, .e_a = e_driver, .i_a = i_a, .omega = omega, .theta = angle_at_end(in)});
    omega_reading = terms_.omega_reading;
    i_a_reading = terms_.i_a_reading;
    torque_reading = terms_.torque_reading;
    if (in.angle_integrated) behind_ = terms_.angle_behind;
  }

  const ModelStructure& structure_;
  std::span<const Scalar> p_;
  Parts driver_parts_, motor_parts_, load_parts_, sensor_parts_;
  std::vector<UserTerm> terms_of_user_, voltages_of_user_;
  Scalar added_{};  ///< [V] by the latter, in the last step
  std::vector<double> term_values_, by_parameter_;
  std::vector<Scalar> memory_;
  Scalar e_slewed_{};      ///< [V] the driver's output before its lag
  Scalar turned_{};        ///< [rad] added to the angle at the start, and to a measured one
  Scalar lead_{};          ///< [rad] of the simulated rotor over a measured angle that wanders
  Scalar angle_before_{};  ///< [rad] measured
  Scalar behind_{};        ///< [rad] by which a measured angle is behind the rotor's, by what the sensors do
  double period_ = 0;      ///< [rad] of the fastest wave
  double field_on_ = 0;    ///< [s] for which the field had been on at the start
  State<Scalar> middle_;
  Balance<Scalar> terms_;
  Scalar omega_before_{};
  Scalar i_a_before_{};

  struct Change {
    double t, u_ref;
  };
  std::vector<Change> changes_;  ///< of the reference; kept only where effects of the driver may delay them
  std::size_t arrived_ = 0;      ///< the last that the driver has seen

  // Kept until something that they depend on changes.
  struct Solved {
    Scalar resistance{}, inductance{}, flux{}, viscous{}, inertia{};
  } solved_;
  double solved_h_ = 0;
  bool solved_conducts_ = false;
  Scalar k_b_{}, k_m_{};
  bool inductive_ = false;    ///< false: no inductance, and its terms are not computed
  Scalar holding_{};          ///< [ohm] voltage that stops a current within the step, per ampere
  Response mean_, end_;       ///< current: mean over the step, and at its end
  Scalar late_{};             ///< [N m/V] of a voltage that grows over the step
  Scalar momentum_{};         ///< J'/h - B/2; J' is J but for what the trapezoidal rule errs
  Scalar inverse_inertia_{};  ///< 1/(J'/h + B/2 + K_m K_b mean_.v1)
};

}  // namespace emtb
