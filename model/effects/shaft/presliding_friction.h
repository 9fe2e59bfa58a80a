#pragma once

#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Dry friction that gives before it slips, as bristles do. They are damped critically: a real contact does not ring.
struct PreslidingFriction {
  static constexpr EffectInfo info{
      .id = "presliding_friction",
      .name = "presliding friction",
      .stage = Stage::shaft,
      .equation = "T = sigma_0 z, dz/dt = omega, up to the torque of dry friction, at which it slips",
      .what = "Seals, grease and teeth bend before they slide, and spring back.",
      .shows =
          "Around a reversal friction comes on over an angle and not at once; at rest the shaft gives way and springs "
          "back.",
      .told_apart =
          "From coulomb_friction by angles around reversals; from backlash, in which nothing holds the shaft within "
          "the "
          "angle.",
      .source = "Prandtl's element; Canudas de Wit et al. (1995): LuGre, sigma_0; Dupont et al. (2002): elasto-plastic",
      .parameter_list =
          {{{.symbol = "sigma_0", .unit = "N m/rad", .null = infinity, .min = 1e-6, .max = 1e9, .typical = 5}}},
      .quick = true,
      .needs = "coulomb_friction"};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& sigma_0 = p[0];
    balance.bristle += sigma_0;
  }

  /// A friction of a tenth of the motor's torque that gives by some millionths to thousandths of the way in which the
  /// machine gets going.
  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    const double travel = std::max(seen.speed * seen.response, 1e-9);  // [rad]
    for (const double share : {3e-5, 2e-4, 7e-4, 3e-3, 3e-2}) all.push_back({0.1 * seen.torque / (share * travel)});
    return all;
  }

  /// Even the motor's whole torque bends it by some turns at most.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_least(0, machine.stall_torque() / 20, "a spring of several turns");
  }
};

}  // namespace emtb
