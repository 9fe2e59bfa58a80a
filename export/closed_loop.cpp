#include "export/closed_loop.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "hal/error.h"
#include "model/step.h"

namespace emtb {
namespace {

/// One PI that does not wind up: while the driver cannot follow, only what leads back is added up.
class Integrating {
 public:
  explicit Integrating(const Pi& gains) : gains_(gains) {}

  double of(double error, double h, int limited) {
    const bool deeper = (limited > 0 && error > 0) || (limited < 0 && error < 0);
    if (!deeper) sum_ += gains_.ki * error * h;
    return gains_.kp * error + sum_;
  }

 private:
  Pi gains_;
  double sum_ = 0;
};

/// The controller with what it knows of the motor.
class Controller {
 public:
  Controller(const Model& model, const Gains& gains, const StepWishes& wishes)
      : gains_(gains), loop_(wishes.loop), speed_(gains.speed), current_(gains.current), direct_(gains.direct) {
    if (!wishes.feed_forward || wishes.speed == 0) return;
    const LinearMachine held = linearise(model, {.omega = wishes.speed});
    current_ahead_ = held.i_a;
    voltage_ahead_ = held.R * held.i_a;
  }

  /// @param limited 1 or -1 where the driver is behind on that side
  double voltage(double wanted, double omega, double i_a, double h, int limited) {
    const bool moving = wanted != 0;
    if (loop_ == Loop::direct) return direct_.of(wanted - omega, h, limited) + (moving ? voltage_ahead_ : 0);
    const double current = speed_.of(wanted - omega, h, limited) + (moving ? current_ahead_ : 0);
    return current_.of(current - i_a, h, limited) + gains_.back_emf * omega;
  }

 private:
  Gains gains_;
  Loop loop_;
  Integrating speed_, current_, direct_;
  double current_ahead_ = 0, voltage_ahead_ = 0;
};

/// Times and overshoot from the speed over time.
void measure(StepAnswer& a, double from, double to) {
  const double nowhere = std::numeric_limits<double>::quiet_NaN();
  double tenth = nowhere, most = 0, last_off = 0;
  a.rise = a.settled = nowhere;
  for (std::size_t k = 0; k < a.t.size(); ++k) {
    const double share = a.omega[k] / to;
    if (std::isnan(tenth) && share >= 0.1) tenth = a.t[k];
    if (std::isnan(a.rise) && share >= 0.9) a.rise = a.t[k] - tenth;
    if (std::abs(share - 1) > 0.02) last_off = a.t[k];
    most = std::max(most, share);
    a.largest_current = std::max(a.largest_current, std::abs(a.i_a[k]));
  }
  a.overshoot = std::max(0.0, most - 1);
  a.left = to - a.omega.back();
  if (last_off < a.t.back()) a.settled = last_off - from;
}

}  // namespace

StepAnswer step_answer(const Model& model, const Gains& gains, const StepWishes& wishes) {
  if (model.input == Signal::i_a) {
    throw ModelError("model `" + model.name +
                     "` is a current drive's: it closes the current loop by itself. Gains are " +
                     "for input: u_ref or e_a");
  }
  ModelStructure structure = model.structure();
  structure.measured_voltage = model.input == Signal::e_a;  // e_a is set, not predicted
  const std::vector<double> values = model.values();
  Machine<double> machine(structure, values);
  const DriverModel driver = model.driver.value_or(DriverModel{});
  Controller controller(model, gains, wishes);
  StepInput in{};
  machine.start({}, in);
  StepAnswer answer;
  constexpr double before = 0.02, longest_step = 1e-3;
  const double h = 1 / wishes.rate;
  const int steps = std::max(1, static_cast<int>(std::ceil(h / longest_step - 1e-9)));
  const auto n = static_cast<std::size_t>(wishes.duration / h);
  int limited = 0;
  std::size_t limited_samples = 0;
  for (std::size_t k = 0; k < n; ++k) {
    const double t = static_cast<double>(k) * h, wanted = t < before ? 0 : wishes.speed;
    const double e = controller.voltage(wanted, machine.omega_reading(), machine.i_a_reading(), h, limited);
    const double given = std::clamp(e, driver.min, driver.max);
    in.u_ref = given / driver.gain;
    in.e_a_mean = in.e_a_end = given;
    for (int s = 0; s < steps; ++s) machine.step(in, t + s * h / steps, h / steps);
    const double behind = model.input == Signal::u_ref ? given - machine.e_a_reading : 0;
    const double by_slew = (behind > 0 ? driver.rise : driver.fall) * h;
    limited = e > driver.max || behind > by_slew ? 1 : e < driver.min || -behind > by_slew ? -1 : 0;
    if (limited != 0) ++limited_samples;
    answer.t.push_back(t + h);
    answer.omega.push_back(machine.omega);
    answer.i_a.push_back(machine.i_a);
    answer.e_a.push_back(given);
  }
  answer.limited = static_cast<double>(limited_samples) / static_cast<double>(std::max<std::size_t>(1, n));
  measure(answer, before, wishes.speed);
  return answer;
}

}  // namespace emtb
