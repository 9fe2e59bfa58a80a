#include "drivers/simulated/plant.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "drivers/simulated/plant_laws.h"

namespace emtb::simulated {
namespace {

/// [s] The longest step: classical Runge-Kutta is then exact to 1e-8 for the slowest things and 1e-4 for the fastest.
constexpr double longest_step = 1e-4;
/// [s] The shortest step: 200 in a millisecond still keep ahead of real time.
constexpr double shortest_step = 5e-6;
/// [s] Time constants below this are taken as zero: no instrument on the bench sees them.
constexpr double no_lag = 2 * shortest_step;
/// [s] A change of the reference this close to a step's end is at its end.
constexpr double instant = 1e-9;

/// [s] between the readings that go on a late bus, at least.
constexpr double bus_interval = 1e-4;

constexpr double copper = 0.00393;   ///< [1/K]
constexpr double disc_cooling = 60;  ///< [s] of the eddy brake's disc

/// What decays forever ends in denormal numbers, which are a hundred times slower. 1e-30 of any unit here is nothing.
double settled(double x) noexcept { return std::abs(x) < 1e-30 ? 0 : x; }

}  // namespace

template <class Function>
void Plant::each(Function f) const noexcept {
  f(&State::i);
  f(&State::omega);
  f(&State::theta);
  f(&State::charge);
  f(&State::heat);
  f(&State::squares);
  if (!rare_) return;
  f(&State::past);
  f(&State::lag_1);
  f(&State::lag_2);
  f(&State::omega_2);
  f(&State::twist);
  f(&State::tacho_1);
  f(&State::tacho_2);
  f(&State::gauge_1);
  f(&State::gauge_2);
}

Plant::Plant(PlantParameters parameters) : p_(std::move(parameters)) {
  check(p_);
  derive();
  const auto& driver = p_.driver;
  target_ = settled_voltage(0, driver, p_.laws);
  state_.e = state_.lag_1 = state_.lag_2 = std::clamp(0.0, driver.min, driver.max);
  state_.i =
      inductance_ > 0 ? 0 : armature_current(driving_voltage(state_, state_.e, 0), mean_output(state_, state_.e), 0);
  // A load that friction of the motor holds at rest has bent the shaft.
  const double pulls = load_torque(0, 0);
  if (p_.shaft.stiffness != unlimited && pulls != 0 && std::abs(pulls) <= p_.friction.T_c + p_.friction.T_s)
    state_.twist = pulls / p_.shaft.stiffness + std::copysign(p_.shaft.gap / 2, pulls);
}

void Plant::become(const PlantParameters& parameters) {
  check(parameters);
  p_ = parameters;
  inductance_ = see_ = lag_1_ = lag_2_ = tacho_1_ = tacho_2_ = gauge_1_ = gauge_2_ = stiffness_ = damping_ = 0;
  derive();
  resistance_ = p_.motor.R_a * (1 + copper * winding_) + p_.driver.output_resistance;
}

/// What follows from the parameters.
void Plant::derive() {
  const auto& [laws, driver, motor, friction, shaft, load, sensors, torque, drop] = p_;
  const bool usual = laws == Laws::usual;
  resistance_ = motor.R_a + driver.output_resistance;
  takes_none_back_ = driver.rectified > 0 || driver.one_quadrant;
  one_way_ = driver.rectified > 0 || driver.min >= 0;
  inertia_ = shaft.stiffness == unlimited ? motor.J : motor.J - shaft.J_2;

  longest_step_ = longest_step;
  const auto follow = [this](double time_constant) {
    longest_step_ = std::clamp(time_constant / 2, shortest_step, longest_step_);
  };
  const auto lag = [&](double& member, double time_constant) {
    if (time_constant <= no_lag) return;
    member = time_constant;
    follow(time_constant);
  };
  // The brushes' knee adds to the resistance where the current is small.
  const double electrical = motor.L_a / (resistance_ + motor.brush_drop / motor.brush_current);
  if (electrical > no_lag) {
    inductance_ = motor.L_a;
    follow(2 * electrical);  // the knee is passed in an instant; beyond it the time constant is longer
  }
  lag(lag_1_, usual ? driver.lag : driver.lag / 2);
  if (!usual) lag(lag_2_, driver.lag / 2);
  lag(tacho_1_, usual ? sensors.tacho_lag : 0.8 * sensors.tacho_lag);
  if (!usual) lag(tacho_2_, 0.2 * sensors.tacho_lag);
  lag(gauge_1_, usual ? sensors.torque_lag : sensors.torque_lag / 2);
  if (!usual) lag(gauge_2_, sensors.torque_lag / 2);
  if (motor.reaction > 0 || driver.conduction_rise > 0 || p_.hidden_drop) {
    lag(see_, usual ? 2e-4 : 1e-3);
    // The rise falls with the current that it drives: a loop, and faster than its lag by its gain.
    follow(see_ / (1 + driver.conduction_rise / driver.conduction_current / resistance_));
  }
  if (const double grip = friction.T_c + friction.T_s; grip > 0) {
    stiffness_ = grip / friction.deflection;
    damping_ = 2 * std::sqrt(stiffness_ * inertia_);  // critical: a real contact does not ring
    if (friction.law == FrictionLaw::bristle) follow(0.4 * std::sqrt(inertia_ / stiffness_));
  }
  if (shaft.stiffness != unlimited) {
    follow(0.4 * std::sqrt(inertia_ * shaft.J_2 / motor.J / shaft.stiffness));
    if (shaft.damping > 0) follow(inertia_ * shaft.J_2 / motor.J / shaft.damping);
  }
  if (driver.delay > 0 || driver.sampling > 0) {
    on_its_way_.resize(4 + static_cast<std::size_t>(driver.delay / 5e-5));  // a loop of 20 kHz
  }
  if (sensors.delay > 0) {
    const Reading now = read_now(), long_ago{time_ - 1e6, now.tacho, now.theta};
    on_the_bus_.assign(4 + static_cast<std::size_t>(sensors.delay / bus_interval), long_ago);
    on_the_bus_[newest_ = 0] = now;
  } else {
    on_the_bus_.clear();
  }
  rare_ = see_ > 0 || lag_1_ > 0 || tacho_1_ > 0 || gauge_1_ > 0 || shaft.stiffness != unlimited;
}

void Plant::advance(double dt, double reference) noexcept {
  if (!(dt > 0)) return;
  send(reference);
  receive();
  // The small number: 1 ms is ten steps of 0.1 ms, not eleven, however it is rounded.
  const int steps = std::max(1, static_cast<int>(std::ceil(dt / longest_step_ - 1e-6)));
  for (int n = 0; n < steps; ++n) {
    double left = dt / steps;
    while (waiting_ > 0 && on_its_way_[first_].due < time_ + left - instant) {
      const double until = on_its_way_[first_].due - time_;
      step(until);
      left -= until;
      receive();
    }
    step(left);
  }
}

/// Gives the driver its reference, which it may see later.
void Plant::send(double reference) noexcept {
  const auto& driver = p_.driver;
  followed_ = std::clamp(followed_, reference - driver.play / 2, reference + driver.play / 2);
  if (on_its_way_.empty()) {
    sent_ = followed_;
    target_ = settled_voltage(sent_, driver, p_.laws);
    return;
  }
  if (followed_ == sent_) return;
  sent_ = followed_;
  const double sampled = driver.sampling > 0 ? std::ceil(time_ / driver.sampling - instant) * driver.sampling : time_;
  const Change change{.due = sampled + driver.delay, .value = sent_};
  const auto last = (first_ + waiting_ + on_its_way_.size() - 1) % on_its_way_.size();
  if (waiting_ > 0 && (waiting_ == on_its_way_.size() || on_its_way_[last].due >= change.due - instant)) {
    on_its_way_[last].value = sent_;  // seen at the same moment
  } else {
    on_its_way_[(last + 1) % on_its_way_.size()] = change;
    ++waiting_;
  }
}

/// What has arrived becomes the driver's target. Without slope its output is there at once.
void Plant::receive() noexcept {
  const auto& driver = p_.driver;
  while (waiting_ > 0 && on_its_way_[first_].due <= time_ + instant) {
    target_ = settled_voltage(on_its_way_[first_].value, driver, p_.laws);
    first_ = (first_ + 1) % on_its_way_.size();
    --waiting_;
  }
  if (target_ > state_.e ? driver.rise == unlimited : driver.fall == unlimited) state_.e = target_;
}

void Plant::step(double dt) noexcept {
  if (!(dt > 0)) return;
  const double heat = state_.heat;
  bend_lining(dt / 2);
  if (p_.friction.law == FrictionLaw::hard && stiffness_ > 0) {
    step_hard(dt, 0);
  } else {
    step_bristle(dt);
  }
  bend_lining(dt / 2);
  each([this](auto member) { state_.*member = settled(state_.*member); });
  remember(dt, state_.heat - heat);
  send_reading();
}

/// What a step leaves behind: heat, magnetism, a coupling that sticks.
/// @param heat [A2 s] of the step
void Plant::remember(double dt, double heat) noexcept {
  const auto& motor = p_.motor;
  const bool usual = p_.laws == Laws::usual;
  if (motor.heat_capacity < unlimited) {
    const double loss = motor.R_a * (1 + copper * winding_) * heat;  // [J]
    const double body = usual ? motor.heat_capacity : motor.heat_capacity / 2;
    const double path = usual ? motor.heat_resistance : motor.heat_resistance / 2;
    const double from_winding = (winding_ - iron_) / path * dt;  // the iron stays cold where it is not a body
    winding_ += (loss - from_winding) / body;
    if (!usual) iron_ += (from_winding - iron_ / path * dt) / body;
    resistance_ = motor.R_a * (1 + copper * winding_) + p_.driver.output_resistance;
  }
  if (motor.field_drop > 0) field_ = field(time_, motor, p_.laws);
  if (p_.friction.warm_drop > 0) grease_ = grease(time_, p_.friction, p_.laws);
  if (motor.flux_hysteresis != 0) {
    turned_over_ = std::clamp(turned_over_, state_.i - motor.coercive_current, state_.i + motor.coercive_current);
  }
  if (p_.load.eddy_heating > 0) {
    const double omega = p_.shaft.stiffness == unlimited ? state_.omega : state_.omega_2;
    disc_ += dt * (load_torque() * omega - disc_ / disc_cooling);
  }
  if (p_.sensors.tacho_stick > 0) {
    const double reading = tacho_2_ > 0 ? state_.tacho_2 : tacho_1_ > 0 ? state_.tacho_1 : rippled(state_);
    if (std::abs(reading - stuck_reading_) > p_.sensors.tacho_stick) stuck_reading_ = reading;
  }
}

void Plant::set_load(const LoadParameters& load) {
  check(load);
  p_.load = load;
}

void Plant::open_armature(bool open) noexcept {
  open_ = open;
  state_.i = open || inductance_ > 0
                 ? 0
                 : armature_current(driving_voltage(state_, state_.e, time_), mean_output(state_, state_.e), 0);
}

double Plant::e_a() const noexcept { return at_terminals(state_, state_.e, time_, state_.i); }

double Plant::at_terminals(const State& x, double e, double t, double i) const noexcept {
  const double driving = driving_voltage(x, e, t);
  if (blocks(driving, mean_output(x, e), i)) return back_emf(x);
  return output(x, e, t) - withheld(driving, i) - p_.driver.output_resistance * i;
}

/// [V] What a source at its current limit does not give.
double Plant::withheld(double driving, double i) const noexcept {
  if (std::abs(i) < p_.driver.current_limit) return 0;
  const double over = driving - resistance_ * i - brush_drop(i);
  return over * i > 0 ? over : 0;
}

double Plant::brush_drop(double i) const noexcept {
  const auto& motor = p_.motor;
  return motor.brush_drop == 0 ? 0 : motor.brush_drop * contact(i / motor.brush_current, p_.laws).share;
}

double Plant::tacho() const noexcept { return on_the_bus_.empty() ? read_now().tacho : arrived().tacho; }

double Plant::encoder() const noexcept { return on_the_bus_.empty() ? state_.theta : arrived().theta; }

/// What the sensors put on the bus.
Plant::Reading Plant::read_now() const noexcept {
  const double tacho = p_.sensors.tacho_stick > 0 ? stuck_reading_
                       : tacho_2_ > 0             ? state_.tacho_2
                       : tacho_1_ > 0             ? state_.tacho_1
                                                  : rippled(state_);
  return {time_, tacho, state_.theta};
}

/// What comes out of the bus, straight between what went in. Before anything has, the first.
Plant::Reading Plant::arrived() const noexcept {
  const double at = time_ - p_.sensors.delay;
  const std::size_t n = on_the_bus_.size();
  Reading after = read_now();
  for (std::size_t k = 0; k < n; ++k) {
    const Reading& before = on_the_bus_[(newest_ + n - k) % n];
    if (before.t <= at) {
      const double share = after.t > before.t ? (at - before.t) / (after.t - before.t) : 0;
      return {at, before.tacho + share * (after.tacho - before.tacho),
              before.theta + share * (after.theta - before.theta)};
    }
    after = before;
  }
  return after;
}

void Plant::send_reading() noexcept {
  if (on_the_bus_.empty() || time_ < on_the_bus_[newest_].t + bus_interval) return;
  newest_ = (newest_ + 1) % on_the_bus_.size();
  on_the_bus_[newest_] = read_now();
}

double Plant::load_torque() const noexcept {
  if (p_.shaft.stiffness == unlimited) return load_torque(state_.omega, state_.theta);
  return load_torque(state_.omega_2, state_.theta - state_.twist);
}

double Plant::ammeter() const noexcept { return read_current(state_.i, e_a()); }

/// A bridge takes the current from its supply for as long as it is on: power in is power out.
double Plant::read_current(double i, double e_a) const noexcept {
  return p_.sensors.supply > 0 ? i * std::abs(e_a) / p_.sensors.supply : i;
}

double Plant::gauge() const noexcept {
  return gauge_2_ > 0 ? state_.gauge_2 : gauge_1_ > 0 ? state_.gauge_1 : load_torque();
}

/// The driver's output at an instant, before its resistance.
double Plant::output(const State& x, double e, double t) const noexcept {
  const double mean = mean_output(x, e);
  if (p_.driver.chop_period > 0) return chopped(mean, back_emf(x), p_.driver, p_.laws);
  const double rise = p_.driver.conduction_rise > 0 && mean > 0 ? conduction_rise(x.past, p_.driver, p_.laws) : 0;
  return wave(mean, t) + rise;
}

/// From the driver's mean output to its instantaneous one.
double Plant::wave(double e, double t) const noexcept {
  const auto& driver = p_.driver;
  if (driver.rectified == 0) return e;
  constexpr double pi = std::numbers::pi;
  const double phase = std::fmod(2 * pi * driver.rectified * t, pi);
  if (driver.crest == 0) return e * pi / 2 * std::sin(phase);
  // The mean of crest sin(phase) from the firing angle a to pi is crest (1 + cos a)/pi.
  const double fires = std::acos(std::clamp(pi * e / driver.crest - 1, -1.0, 1.0));
  return phase < fires ? 0 : driver.crest * std::sin(phase);
}

/// The driver's mean output, after its lag.
double Plant::mean_output(const State& x, double e) const noexcept {
  return lag_2_ > 0 ? x.lag_2 : lag_1_ > 0 ? x.lag_1 : e;
}

bool Plant::lets_go() const noexcept { return open_ || (p_.driver.coasts && target_ == 0); }

/// What flows its way already goes on until it is gone; what flows against it dies at once, against the supply.
/// @param mean [V] output
bool Plant::blocks(double driving, double mean, double i) const noexcept {
  if (lets_go()) return true;
  if (!takes_none_back_) return false;
  const double way = one_way_ || mean > 0 ? 1 : mean < 0 ? -1 : 0;
  return way * driving <= 0 && way * i <= 0;
}

double Plant::driver_after(double e, double dt) const noexcept {
  return std::clamp(target_, e - p_.driver.fall * dt, e + p_.driver.rise * dt);
}

double Plant::flux(double past) const noexcept {
  const auto& motor = p_.motor;
  double flux = field_;
  if (motor.reaction > 0) flux *= 1 - reaction(past, motor, p_.laws);
  if (motor.flux_hysteresis != 0) flux *= 1 + motor.flux_hysteresis * std::tanh(turned_over_ / motor.coercive_current);
  return flux;
}

double Plant::back_emf(const State& x) const noexcept { return p_.motor.K_b * flux(x.past) * x.omega; }

/// [V] What drives the current through resistance, inductance and brushes.
double Plant::driving_voltage(const State& x, double e, double t) const noexcept {
  double voltage = output(x, e, t) - back_emf(x);
  if (p_.hidden_drop) voltage -= p_.hidden_drop(x.past, x.omega, x.theta);
  return voltage;
}

/// Solves R i + V_b contact(i/i_b) = voltage.
double Plant::armature_current(double voltage, double mean, double guess) const noexcept {
  if (blocks(voltage, mean, 0)) return 0;
  const double drop = p_.motor.brush_drop;
  if (drop == 0) return let_through(voltage / resistance_, p_.driver, p_.laws);
  // For positive current the left side is concave, so Newton's steps from below the root stay below it and cannot
  // cycle.
  const double v = std::abs(voltage);
  const double knee = p_.motor.brush_current;
  double i = std::max((v - drop) / resistance_, 0.0);
  guess = voltage < 0 ? -guess : guess;
  if (guess > i && resistance_ * guess + drop * contact(guess / knee, p_.laws).share < v) i = guess;
  for (int n = 0; n < 30; ++n) {
    const auto [share, slope] = contact(i / knee, p_.laws);
    const double miss = v - resistance_ * i - drop * share;
    const double change = miss / (resistance_ + drop / knee * slope);
    i += change;
    if (std::abs(change) <= 1e-12 * (i + knee)) break;
  }
  return let_through(std::copysign(i, voltage), p_.driver, p_.laws);
}

double Plant::load_torque(double omega, double theta) const noexcept {
  const auto& load = p_.load;
  double torque = load.torque + held(brake_, omega);
  if (load.eccentric != 0) torque += load.eccentric * std::sin(theta + load.eccentric_phase);
  torque += load.spring_torque + load.spring * theta;
  if (load.eddy_torque == 0) return torque;
  const double x = omega / (load.eddy_omega * (1 + load.eddy_heating * disc_));
  return torque + 2 * load.eddy_torque * x / (1 + x * x);
}

/// [N m] from the motor's side of a compliant shaft to the load's. With a gap, the teeth push and never pull.
double Plant::shaft_torque(const State& x) const noexcept {
  const auto& shaft = p_.shaft;
  const double speed = x.omega - x.omega_2;
  if (shaft.gap == 0) return shaft.stiffness * x.twist + shaft.damping * speed;
  const double pressed = std::abs(x.twist) - shaft.gap / 2;
  if (pressed <= 0) return 0;
  const double side = x.twist > 0 ? 1 : -1;
  return side * std::max(shaft.stiffness * pressed + shaft.damping * side * speed, 0.0);
}

double Plant::torque_without_friction(const State& x, double i, double t) const noexcept {
  const auto& [motor, shaft] = std::tie(p_.motor, p_.shaft);
  double torque = motor.K_m * flux(x.past) * i - grease_ * motor.B * x.omega - windage(x.omega, motor);
  if (motor.bearing_drag != 0) {
    torque -= std::copysign(motor.bearing_drag * std::pow(std::abs(x.omega), motor.bearing_exponent), x.omega);
  }
  if (shaft.cogging != 0) {
    torque -= shaft.cogging * harmonics(shaft.cogging_order * x.theta + shaft.cogging_phase, shaft.cogging_second);
  }
  torque -= shaft.stiffness == unlimited ? load_torque(x.omega, x.theta) : shaft_torque(x);
  if (p_.hidden_torque) torque -= p_.hidden_torque(x.omega, x.theta, t);
  return torque;
}

double Plant::rippled(const State& x) const noexcept {
  const auto& sensors = p_.sensors;
  if (sensors.ripple == 0) return x.omega;
  const double angle = sensors.ripple_order * x.theta + sensors.ripple_phase;
  return x.omega * (1 + sensors.ripple * harmonics(angle, sensors.ripple_second));
}

/// @param i [A] out: the current at this point, which without inductance is no state
Plant::State Plant::slope(const State& x, double e, double t, const Grip& grip, double& i) const noexcept {
  const auto& [motor, shaft] = std::tie(p_.motor, p_.shaft);
  State rate;
  const double driving = driving_voltage(x, e, t);
  if (inductance_ > 0 && blocks(driving, mean_output(x, e), x.i)) {
    i = 0;
  } else if (inductance_ > 0) {
    i = x.i;
    rate.i = (driving - resistance_ * i - brush_drop(i) - withheld(driving, i)) / inductance_;
  } else {
    i = armature_current(driving, mean_output(x, e), i);
  }
  if (!grip.stuck) {
    rate.omega = (torque_without_friction(x, i, t) - held(grip, x.omega)) / inertia_;
    rate.theta = x.omega;
  }
  const bool stiff = shaft.stiffness == unlimited;
  if (!stiff) {
    rate.omega_2 = (shaft_torque(x) - load_torque(x.omega_2, x.theta - x.twist)) / shaft.J_2;
    rate.twist = x.omega - x.omega_2;
  }
  if (lag_1_ > 0) rate.lag_1 = (e - x.lag_1) / lag_1_;
  if (lag_2_ > 0) rate.lag_2 = (x.lag_1 - x.lag_2) / lag_2_;
  if (tacho_1_ > 0) rate.tacho_1 = (rippled(x) - x.tacho_1) / tacho_1_;
  if (tacho_2_ > 0) rate.tacho_2 = (x.tacho_1 - x.tacho_2) / tacho_2_;
  if (gauge_1_ > 0) {
    const double torque = stiff ? load_torque(x.omega, x.theta) : load_torque(x.omega_2, x.theta - x.twist);
    rate.gauge_1 = (torque - x.gauge_1) / gauge_1_;
  }
  if (gauge_2_ > 0) rate.gauge_2 = (x.gauge_1 - x.gauge_2) / gauge_2_;
  if (see_ > 0) rate.past = (i - x.past) / see_;
  const double read = p_.sensors.supply > 0 ? read_current(i, at_terminals(x, e, t, i)) : i;
  rate.charge = read;
  rate.squares = read * read;
  rate.heat = i * i;
  return rate;
}

Plant::State Plant::along(const State& from, const State& slope, double dt) const noexcept {
  State x = from;
  each([&](auto member) { x.*member += dt * (slope.*member); });
  return x;
}

/// Classical Runge-Kutta. The driver's output is known at each stage, slopes and corners included.
Plant::State Plant::integrate(const State& from, double dt, const Grip& grip) const noexcept {
  const double e_half = driver_after(from.e, dt / 2);
  const double e_end = driver_after(from.e, dt);
  double i = from.i;
  const State a = slope(from, from.e, time_, grip, i);
  const State b = slope(along(from, a, dt / 2), e_half, time_ + dt / 2, grip, i);
  const State c = slope(along(from, b, dt / 2), e_half, time_ + dt / 2, grip, i);
  const State d = slope(along(from, c, dt), e_end, time_ + dt, grip, i);
  State to = from;
  each([&](auto m) { to.*m += dt / 6 * (a.*m + 2 * (b.*m + c.*m) + d.*m); });
  to.e = e_end;
  if (inductance_ == 0) {
    to.i = armature_current(driving_voltage(to, e_end, time_ + dt), mean_output(to, e_end), i);
  } else {
    const double driving = driving_voltage(to, e_end, time_ + dt);
    to.i = blocks(driving, mean_output(to, e_end), to.i)
               ? 0
               : std::clamp(to.i, -p_.driver.current_limit, p_.driver.current_limit);
  }
  return to;
}

}  // namespace emtb::simulated
