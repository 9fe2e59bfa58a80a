#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Grease that grows thin as it warms up.
struct FrictionWarmup {
  static constexpr EffectInfo info{
      .id = "friction_warmup",
      .name = "friction warm-up",
      .stage = Stage::shaft,
      .equation = "B, dry friction -> (1 - drop (1 - exp(-t/tau))) of them",
      .what = "Bearings and grease warm up within minutes, and all friction falls.",
      .shows = "The no-load current falls with time at constant speed.",
      .told_apart = "From field_heating, in which the speed rises and the current does, too.",
      .source = "Olsson et al. (1998), on temperature; one time constant",
      .parameter_list =
          {{{.symbol = "drop", .unit = "1", .null = 0, .min = -1, .max = 0.95, .typical = 0.4},
            {.symbol = "tau", .unit = "s", .null = 60, .min = 1e-2, .max = 1e5, .typical = 60, .role = Role::shape}}},
      .parameter_count = 2,
      .in_time = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [drop, tau] = std::tie(p[0], p[1]);
    const Scalar left = 1.0 - drop * (1.0 - exp(-x.t / tau));
    balance.viscous *= left;
    balance.dry_friction *= left;
    balance.gear_friction *= left;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.1, 0.4, 2.0}) all.push_back({0, share * seen.duration});
    return all;
  }

  /// Bearings take minutes.
  static std::string implausible(std::span<const double> p, const FittedMachine&) {
    return Plausible(info, p)
        .at_least(0, 0, "what warm grease does: friction falls")
        .at_least(1, 10, "and no bearing warms up faster");
  }
};

}  // namespace emtb
