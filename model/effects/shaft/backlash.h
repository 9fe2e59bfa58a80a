#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// Play between motor and load.
struct Backlash {
  static constexpr EffectInfo info{
      .id = "backlash",
      .name = "backlash",
      .stage = Stage::shaft,
      .equation = "the shaft's spring acts outside of +-gap/2, and pushes only",
      .what = "A worn coupling or gear lets the shaft turn freely by the gap before it takes the load along.",
      .shows = "A clank at reversals; limit cycles at light load.",
      .told_apart = "From shaft_compliance alone by the start after a reversal, which is too light.",
      .source =
          "Nordin and Gutman (2002), Controlling mechanical systems with backlash: dead-zone model that never pulls",
      .parameter_list = {{{.symbol = "gap", .unit = "rad", .null = 0, .min = 0, .max = 7, .typical = 0.1}}},
      .at_null = AtNull::nothing,
      .quick = true,
      .needs = "shaft_compliance"};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& gap = p[0];
    balance.gap += gap;
  }

  /// From a play that the spring's own twist hides to one that hides the spring. A small one tells nothing of a large
  /// one.
  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.03, 0.1, 0.3, 1.0, 3.0}) all.push_back({share * seen.twist});
    return all;
  }

  /// With any spring: up to the way that the shaft turns while its speed follows the voltage.
  static std::vector<StartValues> starts_beside(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : geometric(0.02, 3, 15)) all.push_back({share * seen.speed * seen.response});
    return all;
  }

  /// A gear or a coupling still takes its load along. Behind a gear the shaft turns by the ratio times the play.
  static std::string implausible(std::span<const double> p, const FittedMachine&) {
    return Plausible(info, p).at_most(0, 6.283, "a turn");
  }
};

}  // namespace emtb
