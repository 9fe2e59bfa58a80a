#pragma once

#include <span>
#include <string>

#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Dry friction, T_c sign(omega). The step that solves for omega keeps the shaft exactly at rest while it holds.
struct CoulombFriction {
  static constexpr EffectInfo info{
      .id = "coulomb_friction",
      .name = "Coulomb friction",
      .stage = Stage::shaft,
      .equation = "T = T_c sign(omega); at rest it holds up to T_c",
      .what = "Brushes, bearings and seals rub with a torque that does not depend on speed.",
      .shows =
          "The no-load current does not vanish with speed; a coast-down ends in a straight line; in a linear fit B "
          "comes out several times too large. Excited by anything that turns at two speeds; best by a coast-down.",
      .told_apart =
          "From B by two speeds; from load_torque by reversal, a gauge or a standstill; from brush_drop and "
          "driver_dead_zone by current in transients.",
      .source = "Olsson et al. (1998), Friction models and friction compensation; step after Moreau",
      .parameter_list = {{{.symbol = "T_c", .unit = "N m", .null = 0, .min = 0, .max = any_torque, .typical = 0.05}}},
      .opposes_motion = true,
      .dry_friction = true,
      .watch = Watch{.rank = 0},
      .changed = {"the motor needs", "a brake left on, does something rub?", "a brake released?"}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& T_c = p[0];
    balance.dry_friction += T_c;
  }

  static double size_at(double share, const Ranges& seen) { return share * seen.torque; }

  /// The motor turned.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, machine.stall_torque(), "what stalls the motor");
  }
};

}  // namespace emtb
