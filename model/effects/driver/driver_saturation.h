#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// An output that ends before its nominal limit: sagging supply, a bridge that never conducts all the time.
struct DriverSaturation {
  static constexpr EffectInfo info{
      .id = "driver_saturation",
      .name = "driver saturation",
      .stage = Stage::driver,
      .equation = "|e_a| <= e_max, in place of the driver's known limit",
      .what = "The supply cannot give more than e_max, whatever the reference asks for.",
      .shows = "e_a and speed are clipped at the top; below it nothing is wrong. Excited by references up to the end.",
      .told_apart = "From windage and driver_gain_error by its knee: those act at all levels.",
      .source = "Leonhard, Control of Electrical Drives; static limit",
      .parameter_list = {{{.symbol = "e_max", .unit = "V", .null = infinity, .min = 1e-3, .max = 1e4, .typical = 105}}},
      .clips = Signal::e_a,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& e_max = p[0];
    if (value_of(balance.min) < 0) balance.min = -e_max;
    balance.max = e_max;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> limits;
    for (const double share : {0.997, 0.99, 0.98, 0.94, 0.88, 0.8, 0.7}) limits.push_back({share * seen.voltage});
    return limits;
  }

  /// One beyond the limit that is known lifts it.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, machine.seen.supply, "the driver's known limit");
  }
};

}  // namespace emtb
