#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A strain gauge that does not read zero without load. Where the shaft takes its load from that gauge, the offset is
/// no load.
struct TorqueOffset {
  static constexpr EffectInfo info{
      .id = "torque_offset",
      .name = "torque gauge offset",
      .stage = Stage::sensors,
      .equation = "reading = T + T_0",
      .what = "The strain gauge's bridge is not balanced.",
      .shows = "The torque reads T_0 without load, and at standstill; the speed knows nothing of it.",
      .told_apart =
          "From load_torque by the speed, which a load lowers, and by standstill: a weight would turn the shaft.",
      .source = "offset error of a bridge",
      .parameter_list =
          {{{.symbol = "T_0", .unit = "N m", .null = 0, .min = -any_torque, .max = any_torque, .typical = 0.015}}},
      .reads = Signal::torque,
      .corrects_load = true,
      .bench = {.torque_gauge = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& T_0 = p[0];
    balance.torque_reading += T_0;
    balance.load_offset += T_0;
  }

  /// An error of the zero, and not the reading.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, machine.stall_torque(), "what stalls the motor");
  }
};

}  // namespace emtb
