#pragma once

#include <span>
#include <string>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"
#include "model/wave.h"

namespace emtb {

/// The poles pull at the teeth.
struct Cogging {
  static constexpr EffectInfo info{
      .id = "cogging",
      .name = "cogging torque",
      .stage = Stage::shaft,
      .equation = "T = T_cog sin(N theta + phase)",
      .what = "The rotor's teeth prefer some angles to others.",
      .shows = "Speed and current ripple with the angle, strongly at crawl, hardly at speed, where inertia hides it.",
      .told_apart = "From tacho_ripple, which grows with speed and leaves the current alone.",
      .source = "Hanselman, Brushless Permanent Magnet Motor Design: first harmonic",
      .parameter_list =
          {{{.symbol = "T_cog", .unit = "N m", .null = 0, .min = 0, .max = any_torque, .typical = 0.1},
            {.symbol = "N", .unit = "1/turn", .null = 12, .min = 2, .max = 400, .typical = 12, .role = Role::order},
            {.symbol = "phase", .unit = "rad", .null = 0, .min = -7, .max = 7, .typical = 1, .role = Role::phase}}},
      .parameter_count = 3,
      .periodic = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [T_cog, N, phase] = std::tie(p[0], p[1], p[2]);
    balance.braking_torque += T_cog * mean_sine<Scalar>(N * x.theta + phase, N * x.omega * x.h);
  }

  /// The motor turned past its teeth.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    if (machine.turns * p[1] < 1 && !machine.parts_of_a_turn_tell) {
      return "no run passes a whole wave, and each would begin elsewhere in it";
    }
    return Plausible(info, p).at_most(0, machine.stall_torque(), "what stalls the motor");
  }
};

}  // namespace emtb
