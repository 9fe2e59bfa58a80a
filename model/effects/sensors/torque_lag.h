#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The filter behind a strain gauge. Where the shaft takes its load from that gauge, what the load effects foretell is
/// on the shaft before it is read.
struct TorqueLag {
  static constexpr EffectInfo info{
      .id = "torque_lag",
      .name = "torque gauge lag",
      .stage = Stage::sensors,
      .equation = "tau dy/dt = T - y, y is read",
      .what = "The strain gauge's amplifier filters its signal.",
      .shows = "The torque reads late whenever it changes.",
      .told_apart = "From shaft_compliance by the absence of ringing.",
      .source = "first-order filter",
      .parameter_list = {{{.symbol = "tau", .unit = "s", .null = 0, .min = 0, .max = 10, .typical = 0.016}}},
      .memory = 2,
      .at_null = AtNull::small,
      .reads = Signal::torque,
      .bench = {.torque_gauge = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& tau = p[0];
    const Scalar taken = balance.torque_reading;
    lag_reading(tau, x.h, memory, balance.torque_reading);
    balance.load_offset += balance.torque_reading - taken;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double time : seen.edge_times()) all.push_back({time});
    return all;
  }

  /// What is slower than the runs reads no torque.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(0, machine.seen.logged_lag, "within which it is how the runs were logged")
        .at_most(0, 0.2 * machine.seen.duration, "a fifth of the longest run");
  }
};

}  // namespace emtb
