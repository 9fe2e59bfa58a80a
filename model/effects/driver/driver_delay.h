#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The time before a driver answers at all.
struct DriverDelay {
  static constexpr EffectInfo info{
      .id = "driver_delay",
      .name = "driver delay",
      .stage = Stage::driver,
      .equation = "e(t) = e_in(t - t_d)",
      .what =
          "A digital bridge computes before it acts; a line-commutated one waits for its next firing, on the mean half "
          "a pulse.",
      .shows = "Edges are shifted as a whole; nothing when settled. Excited by steps.",
      .told_apart =
          "From driver_lag by the shape of the edge: shifted, not rounded. Half a sample of timing error in the data "
          "looks the same.",
      .source = "Leonhard, Control of Electrical Drives: T/(2p) on the mean",
      .parameter_list = {{{.symbol = "t_d", .unit = "s", .null = 0, .min = 0, .max = 2, .typical = 0.03}}},
      .at_null = AtNull::small,
      .family = Family::driver_edges,
      .in_time = true,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& t_d = p[0];
    balance.delay += t_d;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double time : seen.edge_times()) all.push_back({time});
    return all;
  }

  /// What is later than that no run tells.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(0, machine.seen.logging, "within which it is how the runs were logged")
        .at_most(0, 0.2 * machine.seen.duration, "a fifth of the longest run");
  }
};

}  // namespace emtb
