#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A field winding that warms up: its resistance rises, its current and its flux sag.
struct FieldHeating {
  static constexpr EffectInfo info{
      .id = "field_heating",
      .name = "field heating",
      .stage = Stage::air_gap,
      .equation = "K_b, K_m -> K (1 - drop (1 - exp(-t/tau))), t since the field was switched on",
      .what = "The field winding grows warm, and at constant voltage its current falls.",
      .shows = "The speed creeps up at constant voltage, and the current with it.",
      .told_apart = "From friction_warmup by the current, which falls there; from armature_heating by the speed.",
      .source = "copper, 0.393 % a kelvin (IEC 60028); one time constant",
      .parameter_list =
          {{{.symbol = "drop", .unit = "1", .null = 0, .min = -0.5, .max = 0.5, .typical = 0.04},
            {.symbol = "tau", .unit = "s", .null = 100, .min = 1e-2, .max = 1e5, .typical = 100, .role = Role::shape}}},
      .parameter_count = 2,
      .in_time = true,
      .bench = {.field_winding = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [drop, tau] = std::tie(p[0], p[1]);
    balance.flux *= 1.0 - drop * (1.0 - exp(-x.field_on / tau));
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.1, 0.4, 2.0}) all.push_back({0, share * seen.duration});
    return all;
  }

  /// Windings of poles take minutes.
  static std::string implausible(std::span<const double> p, const FittedMachine&) {
    return Plausible(info, p)
        .at_least(0, 0, "what warm copper does: the field sags")
        .at_least(1, 10, "and no winding warms up faster");
  }
};

}  // namespace emtb
