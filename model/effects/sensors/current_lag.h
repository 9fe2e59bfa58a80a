#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The filter behind a shunt or Hall sensor, or the mean that its chip or a firmware takes.
struct CurrentLag {
  static constexpr EffectInfo info{
      .id = "current_lag",
      .name = "current sensor lag",
      .stage = Stage::sensors,
      .equation = "tau dy/dt = i_a - y, y is read",
      .what = "The sensor's amplifier or the firmware smooths the current's reading.",
      .shows = "The current reads late and too low at every edge; the shaft moves in time.",
      .told_apart = "From armature_inductance and driver_lag by the speed, which these make late, too: log fast.",
      .source = "first-order filter",
      .parameter_list = {{{.symbol = "tau", .unit = "s", .null = 0, .min = 0, .max = 10, .typical = 0.01}}},
      .memory = 2,
      .at_null = AtNull::small,
      .reads = Signal::i_a,
      .bench = {.current = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& tau = p[0];
    lag_reading(tau, x.h, memory, balance.i_a_reading);
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double time : seen.edge_times()) all.push_back({time});
    return all;
  }

  /// What is slower than the runs reads no current.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(0, machine.seen.logged_lag, "within which it is how the runs were logged")
        .at_most(0, 0.2 * machine.seen.duration, "a fifth of the longest run");
  }
};

}  // namespace emtb
