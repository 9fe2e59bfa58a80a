#pragma once

#include <span>
#include <string>

#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A torque that does not turn round with the motion: a hanging weight, a spring, a constant offset of the drive.
struct LoadTorque {
  static constexpr EffectInfo info{
      .id = "load_torque",
      .name = "constant load torque",
      .stage = Stage::load,
      .equation = "T = T_L, whatever omega; positive brakes positive rotation",
      .what = "A weight or an unbalanced constant torque pulls the shaft one way.",
      .shows =
          "The current has an offset that does not change its sign with the direction; the shaft may move by itself "
          "with the drive off.",
      .told_apart =
          "From coulomb_friction by a reversal or a standstill; in one direction without a gauge they are the same.",
      .source = "Erdal et al. (2011), equation (5): T_L",
      .parameter_list =
          {{{.symbol = "T_L", .unit = "N m", .null = 0, .min = -any_torque, .max = any_torque, .typical = 0.1}}},
      .watch = Watch{.rank = 1},
      .changed = {"the load takes", "a brake left on?", "a brake released?"}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& T_L = p[0];
    balance.load_torque += T_L;
  }

  static double size_at(double share, const Ranges& seen) { return share * seen.torque; }

  /// The motor moved it.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, machine.stall_torque(), "what stalls the motor");
  }
};

}  // namespace emtb
