#pragma once

#include <span>
#include <string>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"
#include "model/wave.h"

namespace emtb {

/// A weight off the axis.
struct EccentricLoad {
  static constexpr EffectInfo info{
      .id = "eccentric_load",
      .name = "eccentric load",
      .stage = Stage::load,
      .equation = "T = T_e sin(theta + phase)",
      .what = "The load's centre of mass is not on the axis, and gravity pulls at it.",
      .shows = "Speed and current ripple once a turn, strongly at crawl.",
      .told_apart = "From cogging by its order, once a turn; from tacho_ripple by the current.",
      .source = "pendulum",
      .parameter_list =
          {{{.symbol = "T_e", .unit = "N m", .null = 0, .min = 0, .max = any_torque, .typical = 0.05},
            {.symbol = "phase", .unit = "rad", .null = 0, .min = -7, .max = 7, .typical = 1, .role = Role::phase}}},
      .parameter_count = 2,
      .periodic = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [T_e, phase] = std::tie(p[0], p[1]);
    balance.load_torque += T_e * mean_sine<Scalar>(x.theta + phase, x.omega * x.h);
  }

  /// The motor at least swung it. A part of a turn, at another place in each run, is any force that drifts.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    if (machine.turns < 1 && !machine.parts_of_a_turn_tell) {
      return "no run makes a whole turn, and a force that drifts would do as well";
    }
    return Plausible(info, p).at_most(0, 5 * machine.stall_torque(), "five times what stalls the motor");
  }
};

}  // namespace emtb
