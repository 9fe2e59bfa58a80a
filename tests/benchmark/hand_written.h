#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "model/simulation.h"

namespace emtb {

/// The rival of Dual in docs/decisions/sensitivities.md: the step for base model, Coulomb friction and windage,
/// differentiated by hand with respect to R_a, K_b = K_m, B, J, T_c and c_w. Every further effect adds its own terms to
/// each of the lines marked (+).
class HandWritten {
 public:
  using Gradient = std::array<double, 6>;

  HandWritten(const DriverModel& driver, const Gradient& p) : driver_(driver), p_(p) {}

  double e_driver = 0, omega = 0, i_a = 0;
  Gradient d_omega{}, d_i_a{};

  void step(double u_ref, double h) {
    const auto [R, K, B, J, T_c, c_w] = p_;
    const double e0 = e_driver;
    const double target = std::clamp(driver_.gain * u_ref, driver_.min, driver_.max);
    e_driver += std::clamp(target - e_driver, -driver_.fall * h, driver_.rise * h);
    const double mean = 0.5 * (e0 + e_driver), G = 1 / R;

    // J (w1 - w0)/h = K i - B (w0 + w1)/2 - c_w wm |wm| -+ T_c,  i = (mean - K (w0 + w1)/2)/R
    const double wm = omega + 0.5 * (omega - omega_before_), air = wm * std::abs(wm);
    const double alpha = (mean - 0.5 * K * omega) * G;
    const double drive = J * omega / h + K * alpha - 0.5 * B * omega - c_w * air;
    const double inverse = 1 / (J / h + 0.5 * K * K * G + 0.5 * B);
    const bool slips = std::abs(drive) > T_c || T_c == 0;
    const double pull = !slips ? 0 : drive > 0 ? drive - T_c : drive + T_c;
    const double w1 = pull * inverse;

    // What does not come through omega: partial derivatives of pull and of 1/inverse.
    const Gradient d_pull{-K * alpha * G,
                          alpha - 0.5 * K * omega * G,
                          -0.5 * omega,
                          omega / h,
                          drive > 0   ? -1.0
                          : drive < 0 ? 1.0
                                      : 0.0,
                          -air};                                              // (+)
    const Gradient d_inertia{-0.5 * K * K * G * G, K * G, 0.5, 1 / h, 0, 0};  // (+)
    const double through_omega = J / h - 0.5 * K * K * G - 0.5 * B;           // (+)
    const double through_mid = -2 * c_w * std::abs(wm);                       // (+)
    const double i1 = (e_driver - K * w1) * G;
    const Gradient d_i{-i1 * G, -w1 * G, 0, 0, 0, 0};  // (+)
    for (std::size_t j = 0; j < 6; ++j) {
      const double d0 = d_omega[j], d_mid = 1.5 * d0 - 0.5 * d_before_[j];
      const double d = d_pull[j] + through_omega * d0 + through_mid * d_mid - w1 * d_inertia[j];
      d_before_[j] = d0;
      d_omega[j] = slips ? d * inverse : 0;
      d_i_a[j] = d_i[j] - K * G * d_omega[j];
    }
    omega_before_ = omega;
    omega = w1;
    i_a = i1;
  }

  void start(double u_ref) { e_driver = std::clamp(driver_.gain * u_ref, driver_.min, driver_.max); }

 private:
  DriverModel driver_;
  Gradient p_;
  double omega_before_ = 0;
  Gradient d_before_{};
};

template <class Read>
void run_hand_written(const DriverModel& driver, const HandWritten::Gradient& p, const Excitation& x,
                      const Read& read) {
  HandWritten machine(driver, p);
  machine.start(x.u_ref[0]);
  read(0, machine);
  for (std::size_t k = 0; k + 1 < x.t.size(); ++k) {
    machine.step(x.u_ref[k], x.t[k + 1] - x.t[k]);
    read(k + 1, machine);
  }
}

}  // namespace emtb
