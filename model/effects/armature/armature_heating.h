#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Copper that grows warm: its resistance follows.
struct ArmatureHeating {
  static constexpr double copper = 0.00393;  ///< [1/K] of its resistance at 20 degC; IEC 60028
  static constexpr double cold = 20;         ///< [degC] to which R_a refers where the temperature is measured

  static constexpr EffectInfo info{
      .id = "armature_heating",
      .name = "armature heating",
      .stage = Stage::armature,
      .equation = "R = R_a (1 + 0.00393 dT);  C_th d(dT)/dt = R i_a^2 - dT/R_th",
      .what =
          "The current heats the winding. It is cold at the start of a session, unless its temperature is measured: "
          "then R_a is that at 20 degC.",
      .shows =
          "Under load the current falls over minutes at constant voltage, and the speed with it. Excited by heavy load "
          "for a time constant C_th R_th.",
      .told_apart = "From field_heating by the speed: that one raises it. From friction_warmup likewise.",
      .source = "IEC 60028 (copper); one-body thermal model, e.g. Boglietti et al. (2009)",
      .parameter_list =
          {{{.symbol = "C_th", .unit = "J/K", .null = infinity, .min = 1e-3, .max = 1e7, .typical = 200},
            {.symbol = "R_th", .unit = "K/W", .null = 1, .min = 1e-4, .max = 1e4, .typical = 3, .role = Role::shape}}},
      .parameter_count = 2,
      .memory = 1,
      .bench = {.voltage = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [C_th, R_th] = std::tie(p[0], p[1]);
    Scalar& warmer = memory[0];  // [K]
    const Scalar resistance = balance.resistance * (1.0 + copper * warmer);
    if (std::isnan(x.temperature)) {
      // Exact for heat that is constant over the step: stable, however small the capacity.
      const Scalar settled = resistance * x.i_a * x.i_a * R_th;
      warmer = settled + (warmer - settled) * decay(x.h, C_th * R_th);
    } else {
      warmer = Scalar(x.temperature - cold);
    }
    balance.resistance *= 1.0 + copper * warmer;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double kelvin : {4.0, 40.0}) {  // if no heat were lost
      for (const double periods : {0.2, 2.0}) {
        const double capacity = std::max(1e-3, seen.heat / kelvin);
        all.push_back({capacity, periods * seen.duration / capacity});
      }
    }
    return all;
  }

  /// [K] if no heat were lost, or all of it at once.
  static double warmer_at_most(std::span<const double> p, const FittedMachine& machine) {
    const double power = machine.R_a * machine.seen.current * machine.seen.current;
    return std::min(machine.seen.heat / p[0], power * p[1]);
  }

  /// From the winding of a rotor of some grams, whose time constant is 5 s, on.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least("C_th R_th", p[0] * p[1], 5, "s", "the least of small rotors")
        .at_most("the heating", warmer_at_most(p, machine), 200, "K", "what insulation stands");
  }
};

}  // namespace emtb
