#pragma once

#include <vector>

#include "model/dual.h"
#include "model/simulation.h"

namespace emtb {

/// The parameters of PlainMachine, in the order of a structure with these six effects.
template <class Scalar>
struct PlainParameters {
  Scalar R_a{}, K_b{}, K_m{}, B{}, J{};
  Scalar u_d{}, L_a{}, T_c{}, c_w{}, T_L{}, tau{};
  bool dead_zone = false, inductance = false, lag = false;  ///< those that cost time; the others are simply zero
};

/// The step of model/step.h for one fixed model, written down in a row: no stages, no catalogue, no thought for speed.
///
/// step.h must give the same numbers (step_test.cpp), and this, being the same for any Scalar, is where the ways to get
/// sensitivities are compared (tests/benchmark).
template <class Scalar>
class PlainMachine {
 public:
  PlainMachine(const DriverModel& driver, const PlainParameters<Scalar>& p, const Excitation& x)
      : driver_(driver),
        p_(p),
        measured_voltage_(!x.e_a.empty()),
        measured_load_(!x.load.empty()),
        e_driver(clamped(driver.gain * reference(x.u_ref[0]), Scalar(driver.min), Scalar(driver.max))),
        omega(x.initial.omega),
        theta(x.initial.theta),
        i_a(x.initial.i_a.value_or(0)),
        omega_reading(omega),
        omega_before_(omega) {}

  void step(double u_ref, double e_a_start, double e_a_end, double measured_load, double h) {
    const auto& [R, K_b, K_m, B, J, u_d, L_a, T_c, c_w, T_L, tau_tacho, has_u_d, has_L_a, has_tau] = p_;
    const Scalar omega_mid = omega + 0.5 * (omega - omega_before_);

    const Scalar target = clamped(driver_.gain * reference(u_ref), Scalar(driver_.min), Scalar(driver_.max));
    const Scalar way = target - e_driver;
    const Scalar moved = clamped(way, Scalar(-driver_.fall * h), Scalar(driver_.rise * h));
    const double rate = value_of(way) > 0 ? driver_.rise : driver_.fall;
    const Scalar area = e_driver * h + moved * h - 0.5 * moved * abs(moved) / rate;  // of a ramp, then a plateau
    e_driver = e_driver + moved;
    const Scalar e0 = measured_voltage_ ? Scalar(e_a_start) : 2.0 * area / h - e_driver;
    const Scalar e1 = measured_voltage_ ? Scalar(e_a_end) : e_driver;

    const Scalar v0 = e0 - K_b * omega;
    Scalar tau(0.0), carried(0.0), mean_carried(0.0);
    if (has_L_a) {
      tau = L_a / R;
      carried = decay(h, tau);
      mean_carried = tau * (1.0 - carried) / h;
    }
    const Scalar lag = tau / h;
    const Scalar beta = (0.5 - lag * (1.0 - mean_carried)) / R;
    const Scalar alpha = v0 * (0.5 + lag * (1.0 - mean_carried)) / R + (i_a - v0 / R) * mean_carried + beta * e1;

    Scalar dry = T_c;
    Scalar load = T_L;
    if (measured_load_) {
      const bool all = measured_load == 0 || value_of(T_L) / measured_load > 1;
      const Scalar pulls = all ? Scalar(measured_load) : T_L, rest = measured_load - pulls;
      const bool brakes = value_of(rest) * value_of(omega) >= 0;
      if (brakes) dry = dry + abs(rest);
      load = brakes ? pulls : Scalar(measured_load);
    }
    const Scalar gamma = (0.5 + lag * (1.0 - mean_carried) - mean_carried) / R;
    const Scalar damping = 0.5 * (B + K_m * K_b * (gamma + beta));
    const Scalar late = K_m * (gamma + beta) * damping * h / (6.0 * J);
    const Scalar fitted = J / h + damping * damping * h / (3.0 * J);  // the trapezoidal rule's own decay, mended
    const Scalar drive =
        fitted * omega + K_m * alpha + late * (e1 - e0) - 0.5 * B * omega - c_w * omega_mid * abs(omega_mid) - load;
    const Scalar inertia = fitted + K_m * K_b * beta + 0.5 * B;
    Scalar omega_end = soft_threshold(drive, dry) / inertia;
    const double direction = value_of(omega) > 0 ? 1 : -1;
    const Scalar going_on = (drive - direction * dry) / inertia;
    if (value_of(omega) * value_of(going_on) < 0) {  // it stops within the step, and friction turns round with it
      const Scalar until_then = omega / (omega - going_on);
      omega_end = (drive - direction * dry * until_then + direction * dry * (1.0 - until_then)) / inertia;
      if (value_of(omega) * value_of(omega_end) >= 0) omega_end = Scalar(0.0);
    }

    const Scalar v1 = e1 - K_b * omega_end;
    const Scalar trail = (v1 - v0) * tau / (R * h);
    i_a = v1 / R - trail + (i_a - v0 / R + trail) * carried;
    theta = theta + 0.5 * h * (omega + omega_end);
    omega_reading = has_tau ? first_order_lag(tau_tacho, h, omega, omega_end, omega_reading) : omega_end;
    omega_before_ = omega;
    omega = omega_end;
  }

 private:
  Scalar reference(double u_ref) const { return p_.dead_zone ? soft_threshold(Scalar(u_ref), p_.u_d) : Scalar(u_ref); }

  DriverModel driver_;
  PlainParameters<Scalar> p_;
  bool measured_voltage_, measured_load_;

 public:
  Scalar e_driver, omega, theta, i_a, omega_reading;

 private:
  Scalar omega_before_;
};

/// Runs it over an excitation, a step from each reading to the next. @param read called with the number of each reading
template <class Scalar, class Read>
void run_plain(const DriverModel& driver, const PlainParameters<Scalar>& p, const Excitation& x, const Read& read) {
  PlainMachine<Scalar> machine(driver, p, x);
  read(0, machine);
  for (std::size_t k = 0; k + 1 < x.t.size(); ++k) {
    const auto at = [k](const std::vector<double>& values, std::size_t ahead) {
      return values.empty() ? 0.0 : values[k + ahead];
    };
    machine.step(x.u_ref[k], at(x.e_a, 0), at(x.e_a, 1), 0.5 * (at(x.load, 0) + at(x.load, 1)), x.t[k + 1] - x.t[k]);
    read(k + 1, machine);
  }
}

}  // namespace emtb
