#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A disc that turns between magnets.
struct EddyBrake {
  static constexpr EffectInfo info{
      .id = "eddy_brake",
      .name = "eddy-current brake",
      .stage = Stage::load,
      .equation = "T = 2 T_b x/(1 + x^2), x = omega/omega_b",
      .what = "Eddy currents brake a disc, most at the critical speed omega_b, less beyond it.",
      .shows = "Braking with a maximum: the load falls again at high speed.",
      .told_apart = "From B below omega_b, where it is nearly straight; from coulomb_friction far beyond it.",
      .source = "Modelica Standard Library, Rotational.Components.EddyCurrentTorque; Wouterse (1991)",
      .parameter_list = {{{.symbol = "T_b", .unit = "N m", .null = 0, .min = 0, .max = any_torque, .typical = 0.05},
                          {.symbol = "omega_b",
                           .unit = "rad/s",
                           .null = 60,
                           .min = 1e-4,
                           .max = 1e5,
                           .typical = 60,
                           .role = Role::shape}}},
      .parameter_count = 2,
      .opposes_motion = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [T_b, omega_b] = std::tie(p[0], p[1]);
    const Scalar share = x.omega / omega_b;
    balance.load_torque += 2.0 * T_b * share / (1.0 + share * share);
  }

  /// [N m] at a speed [rad/s].
  static double torque_at(std::span<const double> p, double omega) {
    const double share = omega / p[1];
    return 2 * p[0] * share / (1 + share * share);
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.1, 0.3, 0.8}) all.push_back({0, share * seen.speed});
    return all;
  }

  /// Its maximum lies within the speeds that were seen, or near them.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(1, 0.1 * machine.seen.speed, "a tenth of the largest speed")
        .at_most(1, 10 * machine.seen.speed, "ten times the largest speed: below, it is viscous friction")
        .at_most("its torque at speed", torque_at(p, machine.seen.speed), machine.stall_torque(), "N m",
                 "what stalls the motor");
  }
};

}  // namespace emtb
