#pragma once

#include <vector>

#include "model/effect.h"

namespace emtb {

/// A source that gives no more than so much current: a bench supply in its constant-current mode, a servo amplifier.
struct CurrentLimit {
  static constexpr EffectInfo info{
      .id = "current_limit",
      .name = "current limit",
      .stage = Stage::driver,
      .equation = "|i_a| <= i_max; at the limit e_a is what drives i_max",
      .what = "The source holds its current at i_max by giving less voltage than the reference asks for.",
      .shows =
          "The motor starts and reverses at a steady acceleration, with e_a below what was asked for; once it is "
          "fast enough nothing is wrong. Excited by steps from rest to the top.",
      .told_apart =
          "From J by the shape of a start, a ramp in place of an exponential, and by small steps; from "
          "driver_slew by the current, which stands; from driver_saturation by top speed, which is reached.",
      .source = "Leonhard, Control of Electrical Drives: current-limited starting",
      .parameter_list =
          {{{.symbol = "i_max", .unit = "A", .null = infinity, .min = 1e-4, .max = 1e5, .typical = 0.15}}},
      .clips = Signal::i_a,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    balance.current_limit = p[0];
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> limits;
    for (const double share : {0.97, 0.9, 0.8, 0.65, 0.5, 0.35, 0.25}) limits.push_back({share * seen.current});
    return limits;
  }
};

}  // namespace emtb
