#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The air that the rotor drags along, c_w omega |omega|.
struct Windage {
  static constexpr EffectInfo info{
      .id = "windage",
      .name = "windage",
      .stage = Stage::shaft,
      .equation = "T = c_w omega |omega|",
      .what = "Rotor and fan move air; the torque grows with the square of the speed.",
      .shows =
          "The friction curve bends up: B comes out too large at high speed and too small at low speed. Excited by a "
          "staircase to full speed or a coast-down from it.",
      .told_apart = "From coulomb_friction by low speeds; from eddy_brake by speeds beyond its maximum.",
      .source = "Modelica Standard Library, Machines.Losses.Friction (exponent 2)",
      .parameter_list =
          {{{.symbol = "c_w", .unit = "N m s2/rad2", .null = 0, .min = 0, .max = any_torque, .typical = 3e-6}}},
      .opposes_motion = true,
      .brakes_by_speed = true,
      .watch = Watch{.rank = 2, .varies = false}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& c_w = p[0];
    balance.braking_torque += c_w * x.omega * abs(x.omega);
  }

  static double size_at(double share, const Ranges& seen) { return share * seen.torque / (seen.speed * seen.speed); }

  /// The motor reached its speed.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most("its torque at speed", p[0] * machine.seen.speed * machine.seen.speed,
                                      machine.stall_torque(), "N m", "what stalls the motor");
  }
};

}  // namespace emtb
