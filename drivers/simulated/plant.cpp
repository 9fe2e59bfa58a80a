#include "drivers/simulated/plant.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "hal/error.h"

namespace emtb::simulated {
namespace {

/// [s] The longest step: classical Runge-Kutta is then exact to 1e-8 for the slowest things and 1e-4 for the fastest.
constexpr double longest_step = 1e-4;
/// [s] The shortest step: 200 in a millisecond still keep ahead of real time.
constexpr double shortest_step = 5e-6;
/// [s] Time constants below this are taken as zero: no instrument on the bench sees them.
constexpr double no_lag = 2 * shortest_step;

/// What decays forever ends in denormal numbers, which are a hundred times slower. 1e-30 of any unit here is nothing.
double settled(double x) noexcept { return std::abs(x) < 1e-30 ? 0 : x; }

/// tanh to within 1e-16 absolute, in half the time of the library's, which is exact to its last digit near zero, too.
double saturation(double x) noexcept { return 1 - 2 / (std::exp(2 * x) + 1); }

void demand(bool holds, const char* what) {
  if (!holds) throw ConfigError(std::string("simulated plant: ") + what);
}

}  // namespace

Plant::Plant(PlantParameters parameters) : p_(std::move(parameters)) {
  const auto& [driver, motor, friction, load, tacho_lag, hidden] = p_;
  demand(std::isfinite(driver.gain), "driver.gain must be finite");
  demand(driver.rise > 0 && driver.fall > 0, "driver.rise and driver.fall must be above 0");
  demand(driver.min < driver.max, "driver.min must be below driver.max");
  demand(driver.dead_zone >= 0 && driver.output_resistance >= 0,
         "driver.dead_zone, output_resistance must be 0 or more");
  demand(motor.R_a > 0 && motor.J > 0, "motor.R_a and motor.J must be above 0");
  demand(motor.L_a >= 0 && motor.B >= 0 && motor.windage >= 0, "motor.L_a, B and windage must be 0 or more");
  demand(motor.brush_drop >= 0 && motor.brush_current > 0, "motor.brush_drop must be 0 or more, brush_current above 0");
  demand(std::isfinite(motor.K_b) && std::isfinite(motor.K_m), "motor.K_b and K_m must be finite");
  demand(friction.T_c >= 0 && friction.T_s >= 0, "friction.T_c and T_s must be 0 or more");
  demand(friction.omega_s > 0 && friction.deflection > 0, "friction.omega_s and deflection must be above 0");
  demand(std::isfinite(load.torque) && load.eddy_torque >= 0 && load.eddy_omega > 0,
         "load.torque must be finite, eddy_torque 0 or more, eddy_omega above 0");
  demand(tacho_lag >= 0, "tacho_lag must be 0 or more");

  resistance_ = motor.R_a + driver.output_resistance;
  longest_step_ = longest_step;
  const auto follow = [this](double time_constant) {
    longest_step_ = std::clamp(time_constant / 2, shortest_step, longest_step_);
  };
  // The brushes' knee adds to the resistance where the current is small.
  const double electrical = motor.L_a / (resistance_ + motor.brush_drop / motor.brush_current);
  if (electrical > no_lag) {
    inductance_ = motor.L_a;
    follow(2 * electrical);  // the knee is passed in an instant; beyond it the time constant is longer
  }
  if (tacho_lag > no_lag) {
    lag_ = tacho_lag;
    follow(tacho_lag);
  }
  if (const double grip = friction.T_c + friction.T_s; grip > 0) {
    stiffness_ = grip / friction.deflection;
    damping_ = 2 * std::sqrt(stiffness_ * motor.J);  // critical: a real contact does not ring
    if (friction.law == FrictionLaw::bristle) follow(0.4 * std::sqrt(motor.J / stiffness_));
  }
  state_.e = std::clamp(0.0, driver.min, driver.max);
  state_.i = inductance_ > 0 ? 0 : armature_current(state_.e, 0);
}

void Plant::advance(double dt, double reference) noexcept {
  if (!(dt > 0)) return;
  const double voltage = target(reference);
  // The small number: 1 ms is ten steps of 0.1 ms, not eleven, however it is rounded.
  const int steps = std::max(1, static_cast<int>(std::ceil(dt / longest_step_ - 1e-6)));
  const double step = dt / steps;
  // A driver without slope is there at once, not after the step's first stage.
  if (voltage > state_.e ? p_.driver.rise == unlimited : p_.driver.fall == unlimited) state_.e = voltage;
  for (int n = 0; n < steps; ++n) {
    if (p_.friction.law == FrictionLaw::hard && stiffness_ > 0) {
      step_hard(step, voltage, 0);
    } else {
      step_bristle(step, voltage);
    }
    state_.i = settled(state_.i);
    state_.omega = settled(state_.omega);
    state_.tacho = settled(state_.tacho);
  }
}

double Plant::e_a() const noexcept { return state_.e - p_.driver.output_resistance * state_.i; }

double Plant::target(double reference) const noexcept {
  const auto& driver = p_.driver;
  const double effective = std::copysign(std::max(std::abs(reference) - driver.dead_zone, 0.0), reference);
  return std::clamp(driver.gain * effective, driver.min, driver.max);
}

double Plant::driver_after(double e, double target, double dt) const noexcept {
  return std::clamp(target, e - p_.driver.fall * dt, e + p_.driver.rise * dt);
}

/// Solves R i + V_b tanh(i/i_b) = voltage.
double Plant::armature_current(double voltage, double guess) const noexcept {
  const double drop = p_.motor.brush_drop;
  if (drop == 0) return voltage / resistance_;
  // For positive current the left side is concave, so Newton's steps from below the root stay below it and cannot
  // cycle.
  const double v = std::abs(voltage);
  const double knee = p_.motor.brush_current;
  double i = std::max((v - drop) / resistance_, 0.0);
  guess = voltage < 0 ? -guess : guess;
  if (guess > i && resistance_ * guess + drop * saturation(guess / knee) < v) i = guess;
  for (int n = 0; n < 30; ++n) {
    const double bend = saturation(i / knee);
    const double miss = v - resistance_ * i - drop * bend;
    const double change = miss / (resistance_ + drop / knee * (1 - bend * bend));
    i += change;
    if (std::abs(change) <= 1e-12 * (i + knee)) break;
  }
  return std::copysign(i, voltage);
}

double Plant::load_torque(double omega) const noexcept {
  const auto& load = p_.load;
  if (load.eddy_torque == 0) return load.torque;
  const double x = omega / load.eddy_omega;
  return load.torque + 2 * load.eddy_torque * x / (1 + x * x);
}

double Plant::slip_torque(double omega) const noexcept {
  const auto& friction = p_.friction;
  if (friction.T_s == 0) return friction.T_c;
  const double x = omega / friction.omega_s;
  return friction.T_c + friction.T_s * std::exp(-x * x);
}

double Plant::torque_without_friction(double omega, double theta, double i, double t) const noexcept {
  const auto& motor = p_.motor;
  double torque = motor.K_m * i - motor.B * omega - motor.windage * omega * std::abs(omega) - load_torque(omega);
  if (p_.hidden_torque) torque -= p_.hidden_torque(omega, theta, t);
  return torque;
}

/// @param i [A] out: the current at this point, which without inductance is no state
Plant::Slope Plant::slope(const State& x, double e, double t, const Grip& grip, double& i) const noexcept {
  const auto& motor = p_.motor;
  Slope rate;
  const double driving = e - motor.K_b * x.omega;
  if (inductance_ > 0) {
    i = x.i;
    const double brushes = motor.brush_drop == 0 ? 0 : motor.brush_drop * saturation(i / motor.brush_current);
    rate.i = (driving - resistance_ * i - brushes) / inductance_;
  } else {
    i = armature_current(driving, i);
  }
  if (!grip.stuck) {
    const double dry = std::clamp(grip.torque + grip.damping * x.omega, -grip.limit, grip.limit);
    rate.omega = (torque_without_friction(x.omega, x.theta, i, t) - dry) / motor.J;
    rate.theta = x.omega;
  }
  if (lag_ > 0) rate.tacho = (x.omega - x.tacho) / lag_;
  rate.charge = i;
  return rate;
}

/// Classical Runge-Kutta. The driver's output is known at each stage, slopes and corners included.
Plant::State Plant::integrate(const State& from, double dt, double target, const Grip& grip) const noexcept {
  const auto at = [&from](const Slope& rate, double h) {
    State x = from;
    x.i += h * rate.i;
    x.omega += h * rate.omega;
    x.theta += h * rate.theta;
    x.tacho += h * rate.tacho;
    return x;
  };
  const double e_half = driver_after(from.e, target, dt / 2);
  const double e_end = driver_after(from.e, target, dt);
  double i = from.i;
  const Slope a = slope(from, from.e, time_, grip, i);
  const Slope b = slope(at(a, dt / 2), e_half, time_ + dt / 2, grip, i);
  const Slope c = slope(at(b, dt / 2), e_half, time_ + dt / 2, grip, i);
  const Slope d = slope(at(c, dt), e_end, time_ + dt, grip, i);
  const auto mean = [&](double Slope::*rate) { return (a.*rate + 2 * (b.*rate + c.*rate) + d.*rate) / 6; };
  State to = from;
  to.e = e_end;
  to.i += dt * mean(&Slope::i);
  to.omega += dt * mean(&Slope::omega);
  to.theta += dt * mean(&Slope::theta);
  to.tacho += dt * mean(&Slope::tacho);
  to.charge += dt * mean(&Slope::charge);
  if (inductance_ == 0) to.i = armature_current(e_end - p_.motor.K_b * to.omega, i);
  return to;
}

/// The bristle bends with the shaft until it slips; exact for a constant speed, whatever the speed.
Plant::Grip Plant::bend(double dt) noexcept {
  if (stiffness_ == 0) return {};
  const double limit = slip_torque(state_.omega);
  const double most = limit / stiffness_;
  const double bent = bristle_ + state_.omega * dt;
  bristle_ = std::clamp(bent, -most, most);
  return {.torque = stiffness_ * bristle_, .damping = bristle_ == bent ? damping_ : 0, .limit = limit};
}

void Plant::step_bristle(double dt, double target) noexcept {
  const Grip grip = bend(dt / 2);  // half before and half after: second order
  state_ = integrate(state_, dt, target, grip);
  bend(dt / 2);
  time_ += dt;
}

void Plant::step_hard(double dt, double target, int depth) noexcept {
  const double holding = slip_torque(0);
  double direction = state_.omega > 0 ? 1 : -1;
  if (state_.omega == 0) {
    const double pull = torque_without_friction(0, state_.theta, state_.i, time_);
    stuck_ = std::abs(pull) <= holding;
    direction = pull > 0 ? 1 : -1;
  }
  if (stuck_) {
    state_ = integrate(state_, dt, target, {.stuck = true});
    time_ += dt;
    return;
  }
  const double sliding = slip_torque(state_.omega);
  const Grip grip{.torque = direction * sliding, .limit = sliding};
  const State next = integrate(state_, dt, target, grip);
  if (next.omega * direction >= 0) {
    state_ = next;
    time_ += dt;
    return;
  }
  // It stops within this step: go there, stand, and decide from there. Chattering at the limit of holding ends stuck.
  const double part = dt * state_.omega / (state_.omega - next.omega);
  if (part > 0) {
    state_ = integrate(state_, part, target, grip);
    time_ += part;
  }
  state_.omega = 0;
  if (depth < 3) {
    step_hard(dt - part, target, depth + 1);
  } else {
    state_ = integrate(state_, dt - part, target, {.stuck = true});
    time_ += dt - part;
  }
}

}  // namespace emtb::simulated
