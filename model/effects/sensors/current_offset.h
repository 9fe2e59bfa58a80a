#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A current sensor that does not read zero.
struct CurrentOffset {
  static constexpr EffectInfo info{
      .id = "current_offset",
      .name = "current sensor offset",
      .stage = Stage::sensors,
      .equation = "reading = i_a + i_0",
      .what = "A Hall sensor or shunt amplifier has an offset, or keeps some magnetisation.",
      .shows = "A current is read at rest, and the same is added in both directions.",
      .told_apart = "From coulomb_friction by rest and by reversal.",
      .source = "offset error of a Hall sensor",
      .parameter_list = {{{.symbol = "i_0", .unit = "A", .null = 0, .min = -1e3, .max = 1e3, .typical = 0.02}}},
      .watch = Watch{.rank = 5},
      .changed = {"the current is read", "has the sensor's zero moved?", "has the sensor's zero moved?"},
      .reads = Signal::i_a,
      .bench = {.current = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& i_0 = p[0];
    balance.i_a_reading += i_0;
  }

  static double size_at(double share, const Ranges& seen) { return share * seen.current; }

  /// An error of the zero, and not the reading.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, 0.5 * machine.seen.current, "half of the largest current");
  }
};

}  // namespace emtb
