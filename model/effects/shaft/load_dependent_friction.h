#pragma once

#include <span>
#include <string>

#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Gears that rub the more the more torque they carry. What motor and load lay on the teeth is their difference, each
/// counted as it accelerates; the load brakes, so here it is their sum.
struct LoadDependentFriction {
  static constexpr EffectInfo info{
      .id = "load_dependent_friction",
      .name = "load-dependent friction",
      .stage = Stage::shaft,
      .equation = "T = (T_c + k_l |K_m i_a + T_load|) sign(omega); at rest it holds up to that",
      .what = "The teeth of a gear are pressed together by the torque that they carry, and rub in proportion.",
      .shows =
          "Friction is larger under load and while the motor accelerates than at no load; a load that is lowered takes "
          "less current than one that is held.",
      .told_apart =
          "From coulomb_friction by two loads; from K_m by torque in both directions: driving, friction takes a part "
          "of "
          "it, braking, it adds one.",
      .source = "Duclusaud et al. (2025), Extended Friction Models for the Physics Simulation of Servo Actuators: M3",
      .parameter_list = {{{.symbol = "k_l", .unit = "1", .null = 0, .min = 0, .max = 0.9, .typical = 0.1}}},
      .opposes_motion = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& k_l = p[0];
    balance.gear_friction += k_l;
  }

  /// Gears that let most of their torque through.
  static std::string implausible(std::span<const double> p, const FittedMachine&) {
    return Plausible(info, p).at_most(0, 0.8, "a gear that holds itself");
  }
};

}  // namespace emtb
