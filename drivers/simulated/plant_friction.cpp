// How the plant's shaft sticks and slips, and its load's brake.
#include <algorithm>
#include <cmath>

#include "drivers/simulated/plant.h"
#include "drivers/simulated/plant_laws.h"

namespace emtb::simulated {

/// [N m] of dry friction while sliding in a direction.
double Plant::slip_torque(double omega, double direction) const noexcept {
  const auto& friction = p_.friction;
  double torque = friction.T_c;
  if (friction.T_s != 0) torque += friction.T_s * stribeck(omega, friction, p_.laws);
  if (friction.gears != 0) torque += friction.gears * torque_in_gears();
  torque = grease_ * torque + direction * (friction.T_d + friction.B_d * std::abs(omega));
  return std::max(torque, 0.0);
}

/// [N m] What presses the teeth of the gears together.
double Plant::torque_in_gears() const noexcept {
  const double motor = p_.motor.K_m * flux(state_.past) * state_.i, load = -load_torque();
  return p_.laws == Laws::usual ? std::abs(motor - load) : std::abs(motor) + std::abs(load);
}

/// [N m] What a grip opposes to a speed.
double Plant::held(const Grip& grip, double omega) noexcept {
  return std::clamp(grip.torque + grip.damping * omega, grip.lowest, grip.most);
}

/// The bristle bends with the shaft until it slips; exact for a constant speed, whatever the speed.
Plant::Grip Plant::bend(double dt) noexcept {
  if (stiffness_ == 0) return {};
  const double lowest = -slip_torque(state_.omega, -1);
  const double most = p_.friction.T_d == 0 && p_.friction.B_d == 0 ? -lowest : slip_torque(state_.omega, 1);
  const double bent = bristle_ + state_.omega * dt;
  bristle_ = std::clamp(bent, lowest / stiffness_, most / stiffness_);
  return {.torque = stiffness_ * bristle_, .damping = bristle_ == bent ? damping_ : 0, .lowest = lowest, .most = most};
}

/// The brake's lining gives before it slips, as a bristle does. It gives more where a plant's steps are long against
/// what it would swing with.
void Plant::bend_lining(double dt) noexcept {
  const double most = p_.load.brake;
  if (most == 0) {
    lining_ = 0;
    brake_ = {};
    return;
  }
  constexpr double gives = 1e-4;  // [rad]
  const bool stiff = p_.shaft.stiffness == unlimited;
  const double body = stiff ? inertia_ : p_.shaft.J_2, omega = stiff ? state_.omega : state_.omega_2;
  const double stiffness = std::min(most / gives, body * std::pow(0.4 / longest_step_, 2));
  const double bent = lining_ + omega * dt;
  lining_ = std::clamp(bent, -most / stiffness, most / stiffness);
  const double damping = lining_ == bent ? 2 * std::sqrt(stiffness * body) : 0;
  brake_ = {.torque = stiffness * lining_, .damping = damping, .lowest = -most, .most = most};
}

void Plant::step_bristle(double dt) noexcept {
  const Grip grip = bend(dt / 2);  // half before and half after: second order
  state_ = integrate(state_, dt, grip);
  bend(dt / 2);
  time_ += dt;
}

void Plant::step_hard(double dt, int depth) noexcept {
  double direction = state_.omega > 0 ? 1 : -1;
  if (state_.omega == 0) {
    const double pull = torque_without_friction(state_, state_.i, time_);
    direction = pull > 0 ? 1 : -1;
    stuck_ = std::abs(pull) <= slip_torque(0, direction);
  }
  if (stuck_) {
    state_ = integrate(state_, dt, {.stuck = true});
    time_ += dt;
    return;
  }
  const double sliding = direction * slip_torque(state_.omega, direction);
  const Grip grip{.torque = sliding, .lowest = sliding, .most = sliding};
  const State next = integrate(state_, dt, grip);
  if (next.omega * direction >= 0) {
    state_ = next;
    time_ += dt;
    return;
  }
  // It stops within this step: go there, stand, and decide from there. Chattering at the limit of holding ends stuck.
  const double part = dt * state_.omega / (state_.omega - next.omega);
  if (part > 0) {
    state_ = integrate(state_, part, grip);
    time_ += part;
  }
  state_.omega = 0;
  if (depth < 3) {
    step_hard(dt - part, depth + 1);
  } else {
    state_ = integrate(state_, dt - part, {.stuck = true});
    time_ += dt - part;
  }
}

}  // namespace emtb::simulated
