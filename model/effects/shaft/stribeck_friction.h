#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Friction that is larger at crawl than when sliding: the film of grease has not formed yet.
struct StribeckFriction {
  static constexpr EffectInfo info{
      .id = "stribeck_friction",
      .name = "Stribeck friction",
      .stage = Stage::shaft,
      .equation = "T = (T_c + T_s exp(-(omega/omega_s)^2)) sign(omega); at rest it holds up to T_c + T_s",
      .what = "Breaking away takes more torque than sliding on; in between, friction falls with speed.",
      .shows = "The motor starts late and then jerks; it crawls unsteadily. Excited by slow ramps through standstill.",
      .told_apart = "From coulomb_friction by speeds around omega_s; from cogging, which repeats with the angle.",
      .source = "Armstrong-Helouvry, Dupont and Canudas de Wit (1994); Olsson et al. (1998)",
      .parameter_list = {{{.symbol = "T_s", .unit = "N m", .null = 0, .min = 0, .max = any_torque, .typical = 0.04},
                          {.symbol = "omega_s",
                           .unit = "rad/s",
                           .null = 10,
                           .min = 1e-5,
                           .max = 1e4,
                           .typical = 7,
                           .role = Role::shape}}},
      .parameter_count = 2,
      .opposes_motion = true,
      .brakes_by_speed = true,
      .needs = "coulomb_friction"};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [T_s, omega_s] = std::tie(p[0], p[1]);
    const Scalar share = x.omega / omega_s;
    balance.dry_friction += T_s * exp(-share * share);
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.01, 0.04, 0.12, 0.35}) all.push_back({0, share * seen.speed});
    return all;
  }

  /// It is gone at speed.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_most(0, machine.stall_torque(), "what stalls the motor")
        .at_most(1, 0.5 * machine.seen.speed, "half of the largest speed: it is friction at crawl");
  }
};

}  // namespace emtb
