#include "analysis/live/simulated_motor.h"

#include <algorithm>
#include <cmath>

#include "model/simulation_code.h"

namespace emtb {
namespace {

constexpr double longest_bridge = 5;  ///< [s] of a gap that is simulated through: the slowest driver's full travel
constexpr std::size_t longest_unmeasured = 6;  ///< ticks without a voltage: what it was meanwhile is not known; by hand

}  // namespace

SimulatedMotor::SimulatedMotor(const LivePlan& plan)
    : plan_(plan), p_((plan.moved.size() + lanes - 1) / lanes + (plan.moved.empty() ? 1 : 0)) {
  machines_.reserve(p_.size());
}

void SimulatedMotor::follow(std::span<const double> values) {
  values_.assign(values.begin(), values.end());
  for (std::size_t g = 0; g < p_.size(); ++g) {
    p_[g].assign(values.begin(), values.end());  // in the same place: machines look there
    for (std::size_t j = g * lanes; j < std::min(plan_.moved.size(), (g + 1) * lanes); ++j) {
      for (const std::size_t place : plan_.moved[j]) p_[g][place].d[j - g * lanes] = 1;
    }
  }
}

void SimulatedMotor::renew() {
  machines_.clear();
  for (const auto& p : p_) machines_.emplace_back(plan_.structure, std::span<const WideSensitive>(p));
}

std::size_t SimulatedMotor::look_ahead() const {
  return static_cast<std::size_t>(std::lround(first_value_within / plan_.period)) + 3;
}

void SimulatedMotor::start_run(std::span<const LiveTick> ahead) {
  const LiveTick& now = ahead.front();
  const auto speed = first_speed(ahead);
  renew();
  e_a_ = std::isfinite(now.drive) ? now.drive : 0;
  unmeasured_ = 0;
  StepInput in{
      .u_ref = now.u_ref, .e_a_mean = e_a_, .e_a_end = e_a_, .angle_middle = {}, .angle_end = {}, .angle_pull = {}};
  in.i_a = std::isfinite(now.i_a) ? now.i_a : 0;
  in.load = now.load;
  in.omega = in.omega_end = speed.value_or(0);
  InitialState initial;
  initial.omega = in.omega;
  if (std::isfinite(now.i_a)) initial.i_a = now.i_a;
  initial.as_read = true;
  initial.field_on = now.field_on;
  for (auto& machine : machines_) machine.start(initial, in);
  if (plan_.structure.input == Signal::u_ref && begins_elsewhere(ahead, initial)) {
    for (auto& machine : machines_) machine.start(initial, in);
  }
  valid_from_ = now.t + (speed ? plan_.settling : 0);
  before_ = now;
}

double SimulatedMotor::lsb_of(Signal signal) const {
  const auto output = std::ranges::find(plan_.outputs, signal, &LivePlan::Output::signal);
  return output == plan_.outputs.end() ? 0 : output->lsb;
}

std::optional<FirstValue> SimulatedMotor::first_value_of(std::span<const LiveTick> ahead, Signal signal) const {
  std::vector<double> t, value;
  for (const LiveTick& tick : ahead) {
    if (!std::isfinite(tick.at(signal))) continue;
    t.push_back(tick.t);
    value.push_back(tick.at(signal));
  }
  const auto& tell = signal == Signal::e_a ? first_value_of_what_jumps : first_value;
  return tell(t, value, ahead.front().t, lsb_of(signal));
}

std::optional<double> SimulatedMotor::first_speed(std::span<const LiveTick> ahead) const {
  const auto first = first_value_of(ahead, Signal::omega);
  return first && first->is_other_than(0) ? std::optional(first->value) : std::nullopt;
}

bool SimulatedMotor::begins_elsewhere(std::span<const LiveTick> ahead, InitialState& initial) const {
  std::vector<double> u_ref;
  for (const LiveTick& tick : ahead) u_ref.push_back(tick.u_ref);
  const auto first = first_value_of(ahead.first(end_of_first_hold(u_ref)), Signal::e_a);
  if (!first || !first->is_other_than(reading(Signal::e_a))) return false;
  initial.e_driver = first->value;
  if (first->moves()) initial.e_driver_slope = first->slope;
  return true;
}

void SimulatedMotor::resume(const std::vector<Machine<WideSensitive>>& machines, std::span<const LiveTick> ahead) {
  if (machines.empty()) return start_run(ahead);
  machines_.clear();
  for (const auto& machine : machines) machines_.push_back(machine);
  for (std::size_t g = 0; g < machines_.size(); ++g) machines_[g].follow(p_[g]);
  before_ = ahead.front();
  e_a_ = std::isfinite(before_.drive) ? before_.drive : e_a_;
  bridge_gap(ahead);
}

void SimulatedMotor::bridge_gap(std::span<const LiveTick> ahead) {
  const LiveTick& now = ahead.front();
  // What the driver and whatever has a memory did meanwhile, as well as is known: the inputs held.
  LiveTick held = before_;
  before_.t = std::max(before_.t, now.t - longest_bridge);
  held.t = now.t;
  if (now.t > before_.t) step_to(held);
  const double speed = first_speed(ahead).value_or(0);
  for (auto& machine : machines_) machine.turn_at(WideSensitive(speed));
  e_a_ = std::isfinite(now.drive) ? now.drive : e_a_;
  valid_from_ = now.t + plan_.settling;
  before_ = now;
}

void SimulatedMotor::measure_voltage(const LiveTick& now) {
  if (!plan_.structure.measured_voltage) return;
  if (std::isfinite(now.drive)) {
    e_a_ = now.drive;
    unmeasured_ = 0;
  } else if (++unmeasured_ == longest_unmeasured) {
    valid_from_ = now.t + plan_.settling;
  } else if (unmeasured_ > longest_unmeasured) {
    valid_from_ = std::max(valid_from_, now.t + plan_.settling);
  }
}

void SimulatedMotor::step_to(const LiveTick& now) {
  double interval = now.t - before_.t;
  if (std::abs(interval - plan_.period) < 1e-6 * plan_.period) interval = plan_.period;  // rounding of even ticks
  const double e_a_before = e_a_;
  measure_voltage(now);
  const int steps = std::max(1, static_cast<int>(std::ceil(interval / plan_.longest_step - 1e-6)));
  const double h = interval / steps;
  StepInput in{.u_ref = before_.u_ref, .angle_middle = {}, .angle_end = {}, .angle_pull = {}};
  in.i_a = std::isfinite(before_.i_a) ? before_.i_a : value_of(machines_.front().i_a);
  in.load = 0.5 * (before_.load + now.load);
  const double a = std::isfinite(before_.omega) ? before_.omega : value_of(machines_.front().omega);
  in.omega_end = std::isfinite(now.omega) ? now.omega : a;
  in.omega = 0.5 * (a + in.omega_end);
  in.temperature = before_.temperature;
  for (int s = 0; s < steps; ++s) {
    in.e_a_mean = e_a_before + (e_a_ - e_a_before) * (s + 0.5) / steps;
    in.e_a_end = e_a_before + (e_a_ - e_a_before) * (s + 1) / steps;
    for (auto& machine : machines_) simulation_code().step(machine, in, before_.t + s * h, h);
  }
  before_ = now;
}

}  // namespace emtb
