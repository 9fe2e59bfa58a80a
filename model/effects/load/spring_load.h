#pragma once

#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A spring between the load and the frame: of a valve, a throttle, a rack that is pulled back.
struct SpringLoad {
  static constexpr EffectInfo info{
      .id = "spring_load",
      .name = "spring load",
      .stage = Stage::load,
      .equation = "T = T_0 + k theta",
      .what = "A spring holds the load to a place. T_0 is what it pulls with where theta is zero.",
      .shows =
          "The shaft stops on the way and stays there while the current holds it, swings about that place, and goes "
          "back with the drive off.",
      .told_apart =
          "From load_torque and coulomb_friction by the place: the torque grows with the angle; from eccentric_load "
          "beyond a quarter of a turn, or by a weight that passes its top.",
      .source = "Hooke's law; Deur et al. (2004) for the return spring of a throttle",
      .parameter_list = {{{.symbol = "k", .unit = "N m/rad", .null = 0, .min = 0, .max = 1e6, .typical = 0.02},
                          {.symbol = "T_0",
                           .unit = "N m",
                           .null = 0,
                           .min = -any_torque,
                           .max = any_torque,
                           .typical = 0.01,
                           .role = Role::shape}}},
      .parameter_count = 2,
      .in_time = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [k, T_0] = std::tie(p[0], p[1]);
    balance.load_torque += T_0 + k * x.place;  // it holds the shaft, which wanders with no reading of its angle
  }

  /// The motor wound it up, and there is no spring of so many turns, but behind a gear: then it holds the motor back.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    constexpr double most_turns = 20, holds_back = 0.2;  // of the torque that stalls the motor
    Plausible said(info, p);
    const double pulls = p[0] * std::numbers::pi * machine.turns;  // [N m] at either end of that way, from its middle
    if (std::isfinite(machine.turns) && pulls < holds_back * machine.stall_torque())
      said.at_most("the way that a run goes", machine.turns, most_turns, "turns", "and no spring is wound up so far");
    return said.at_most(1, 5 * machine.stall_torque(), "five times what stalls the motor");
  }
};

}  // namespace emtb
