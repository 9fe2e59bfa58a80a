#pragma once

#include <span>
#include <string>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A driver whose gain or zero is not what the model believes.
struct DriverGainError {
  static constexpr EffectInfo info{
      .id = "driver_gain_error",
      .name = "driver gain error",
      .stage = Stage::driver,
      .equation = "target = (1 + k) gain u + e_0, e_0 only while u > 0",
      .what = "The driver's gain is off by k, and its output by e_0 once it is asked for something.",
      .shows = "e_a is off in proportion to the reference, and by a constant; nothing else is.",
      .told_apart =
          "From driver_dead_zone by its part in proportion; where e_a is not measured, its gain is one with K_b.",
      .source = "calibration error of gain and zero; e.g. IEC 60051 for such errors of instruments",
      .parameter_list = {{{.symbol = "k", .unit = "1", .null = 0, .min = -0.5, .max = 0.5, .typical = 0.01},
                          {.symbol = "e_0", .unit = "V", .null = 0, .min = -1000, .max = 1000, .typical = 0.5}}},
      .parameter_count = 2,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const auto& [k, e_0] = std::tie(p[0], p[1]);
    balance.gain *= 1.0 + k;
    if (value_of(balance.u) > 0) balance.offset += e_0;
  }

  /// A zero that is off by more is no calibration error.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(1, 0.3 * machine.seen.voltage, "a third of the voltage");
  }
};

}  // namespace emtb
