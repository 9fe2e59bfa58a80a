#pragma once

#include <span>
#include <string>

#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A brake that rubs at the load's end of the shaft. Which of two dry frictions holds a shaft at rest is not settled by
/// their torques; here the motor's holds first, since it is nearer to what pulls, and the brake takes what that leaves.
struct DryBrake {
  static constexpr EffectInfo info{
      .id = "dry_brake",
      .name = "dry brake",
      .stage = Stage::load,
      .equation = "T = T_b sign(omega); at rest it holds up to T_b of what the motor's own friction leaves",
      .what = "A shoe or a band rubs on the load's drum with a torque that does not depend on speed.",
      .shows = "The gauge reads the same torque at any speed, of the sign of the speed, and nothing at rest.",
      .told_apart =
          "From coulomb_friction by the gauge, which sees the brake alone; from load_torque by reversal or standstill.",
      .source = "Erdal et al. (2011), figure 7: the brake of their bench; step after Moreau, as for coulomb_friction",
      .parameter_list = {{{.symbol = "T_b", .unit = "N m", .null = 0, .min = 0, .max = any_torque, .typical = 0.08}}},
      .opposes_motion = true,
      .bench = {.torque_gauge = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& T_b = p[0];
    balance.brake += T_b;
  }

  /// The motor turned.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, machine.stall_torque(), "what stalls the motor");
  }
};

}  // namespace emtb
