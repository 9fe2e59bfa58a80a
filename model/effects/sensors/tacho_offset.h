#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A tachogenerator that does not read zero at rest.
struct TachoOffset {
  static constexpr EffectInfo info{
      .id = "tacho_offset",
      .name = "tachogenerator offset",
      .stage = Stage::sensors,
      .equation = "reading = omega + omega_0",
      .what = "The amplifier behind the tachogenerator has an offset.",
      .shows = "The speed reads omega_0 at rest, and is off by it at every speed.",
      .told_apart = "From driver_dead_zone and coulomb_friction by its reading at rest.",
      .source = "offset error of an amplifier",
      .parameter_list = {{{.symbol = "omega_0", .unit = "rad/s", .null = 0, .min = -1e3, .max = 1e3, .typical = 0.7}}},
      .watch = Watch{.rank = 4},
      .changed = {"the tacho reads", "has its zero moved?", "has its zero moved?"},
      .reads = Signal::omega,
      .bench = {.tachogenerator = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& omega_0 = p[0];
    balance.omega_reading += omega_0;
    balance.angle_behind -= omega_0 * x.t;
  }

  static double size_at(double share, const Ranges& seen) { return share * seen.speed; }

  /// An error of the zero, and not the reading.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, 0.5 * machine.seen.speed, "half of the largest speed");
  }
};

}  // namespace emtb
