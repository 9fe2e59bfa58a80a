#pragma once

#include <cmath>
#include <span>
#include <string>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Friction that differs between the directions: skewed brushes, a screw, a seal with a lip.
struct AsymmetricFriction {
  static constexpr EffectInfo info{
      .id = "asymmetric_friction",
      .name = "asymmetric friction",
      .stage = Stage::shaft,
      .equation = "T = T_d + B_d |omega| while moving, beside T_c sign(omega)",
      .what = "Forward and backward rub differently.",
      .shows = "The no-load current differs between the directions.",
      .told_apart =
          "From load_torque by standstill, where it pulls and friction does not; in one direction it is T_c and B.",
      .source = "Janot, Gautier and Brunot (2019) on EMPS; Armstrong-Helouvry et al. (1994)",
      .parameter_list =
          {{{.symbol = "T_d", .unit = "N m", .null = 0, .min = -any_torque, .max = any_torque, .typical = 0.02},
            {.symbol = "B_d", .unit = "N m s/rad", .null = 0, .min = -any_torque, .max = any_torque, .typical = 1e-4}}},
      .parameter_count = 2,
      .brakes_by_speed = true,
      .needs = "coulomb_friction"};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    if (value_of(x.omega) == 0) return;
    const auto& [T_d, B_d] = std::tie(p[0], p[1]);
    balance.braking_torque += T_d + B_d * abs(x.omega);
  }

  /// The motor turned.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_most(0, machine.stall_torque(), "what stalls the motor")
        .at_most("B_d times the speed", std::abs(p[1]) * machine.seen.speed, machine.stall_torque(), "N m",
                 "what stalls the motor");
  }
};

}  // namespace emtb
