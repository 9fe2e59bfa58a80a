#pragma once

#include <span>
#include <string>

#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Armature inductance: the term of equation (1) that equation (2) neglects.
struct ArmatureInductance {
  static constexpr EffectInfo info{
      .id = "armature_inductance",
      .name = "armature inductance",
      .stage = Stage::armature,
      .equation = "L_a di_a/dt = e_a - R_a i_a - K_b omega",
      .what = "The current needs time to follow the voltage.",
      .shows =
          "The current lags the edges of the voltage, the speed a little. Excited by fast edges; slow drivers hide it.",
      .told_apart = "From tacho_lag by the current: in the speed alone they are the same.",
      .source = "Erdal et al. (2011), equation (1)",
      .parameter_list = {{{.symbol = "L_a", .unit = "H", .null = 0, .min = 0, .max = 100, .typical = 1}}},
      .quick = true,
      .bench = {.voltage = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& L_a = p[0];
    balance.inductance += L_a;
  }

  /// The current follows faster than the speed does.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    constexpr double unseen = 0.1;  // of a sample: the logger's timing does as much
    const double tau = p[0] / machine.R_a;
    return Plausible(info, p)
        .at_least("L_a/R_a", tau, unseen * machine.seen.sample, "s", "a tenth of a sample")
        .at_most("L_a/R_a", tau, machine.time_constant(), "s", "the mechanical time constant");
  }
};

}  // namespace emtb
