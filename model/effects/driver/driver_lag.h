#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The filter at the output of a driver.
struct DriverLag {
  static constexpr EffectInfo info{
      .id = "driver_lag",
      .name = "driver lag",
      .stage = Stage::driver,
      .equation = "tau de/dt = e_in - e",
      .what = "A smoothing filter or a slow regulator rounds what the driver does.",
      .shows = "The edges of e_a are exponential; nothing is wrong when settled.",
      .told_apart = "From driver_delay by the shape of the edge; from tacho_lag by a measured e_a.",
      .source = "first-order filter; Leonhard, Control of Electrical Drives",
      .parameter_list = {{{.symbol = "tau", .unit = "s", .null = 0, .min = 0, .max = 10, .typical = 0.07}}},
      .at_null = AtNull::small,
      .family = Family::driver_edges,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& tau = p[0];
    balance.lag += tau;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double time : seen.edge_times()) all.push_back({time});
    return all;
  }

  /// What is slower than the runs is a drift.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(0, machine.seen.logged_lag, "within which it is how the runs were logged")
        .at_most(0, 0.2 * machine.seen.duration, "a fifth of the longest run");
  }
};

}  // namespace emtb
