#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A line-commutated rectifier at light load: between its pulses no current flows, and the voltage rises.
struct DiscontinuousConduction {
  static constexpr EffectInfo info{
      .id = "discontinuous_conduction",
      .name = "discontinuous conduction",
      .stage = Stage::driver,
      .equation = "e_a = e + V_d exp(-|i_a|/i_c), e > 0",
      .what = "Where the current has gaps, the rectifier's mean voltage is higher than its firing angle says.",
      .shows = "e_a is too high at light load only, which is where a small bench lives.",
      .told_apart = "From driver_output_resistance, which is straight, by load; from driver_gain_error by no load.",
      .source = "Leonhard, Control of Electrical Drives, ch. 8: intermittent current; exponential as a smooth stand-in",
      .parameter_list =
          {{{.symbol = "V_d", .unit = "V", .null = 0, .min = 0, .max = 1e3, .typical = 3},
            {.symbol = "i_c", .unit = "A", .null = 0.1, .min = 1e-6, .max = 1e3, .typical = 0.1, .role = Role::shape}}},
      .parameter_count = 2,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const auto& [V_d, i_c] = std::tie(p[0], p[1]);
    balance.light_load_rise += V_d;
    balance.light_load_current += i_c;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.01, 0.05, 0.2}) all.push_back({0, share * seen.current});
    return all;
  }

  /// At light load alone; else it is another gain.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_most(0, machine.seen.voltage, "the largest voltage")
        .at_most(1, machine.seen.current, "the largest current: light load alone lifts the voltage");
  }
};

}  // namespace emtb
