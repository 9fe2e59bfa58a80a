#pragma once

#include "model/dual.h"
#include "model/effect.h"

namespace emtb {

/// A rectifier or chopper that cannot take current back, or a bridge that is chopped by its enable inputs.
struct OneQuadrantDriver {
  static constexpr EffectInfo info{
      .id = "one_quadrant_driver",
      .name = "one-quadrant driver",
      .stage = Stage::driver,
      .equation = "i_a e_a >= 0; while it blocks i_a = 0 and e_a = K_b omega",
      .what =
          "The driver has no way to take current back: a motor that turns too fast for its voltage coasts, either way.",
      .shows = "The motor coasts instead of braking on falling references, and e_a stays above what was asked for.",
      .told_apart = "From a slow fall (driver_slew) by the current, which is zero; from J by rising edges.",
      .source = "Krause, Wasynczuk and Sudhoff, Analysis of Electric Machinery: one-quadrant chopper",
      .parameter_count = 0,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar>, Balance<Scalar>& balance) {
    balance.one_quadrant = true;
  }
};

}  // namespace emtb
