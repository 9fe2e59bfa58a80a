#pragma once

#include "model/dual.h"
#include "model/effect.h"

namespace emtb {

/// A bridge that opens all its switches where it is asked for nothing.
struct CoastingDriver {
  static constexpr EffectInfo info{
      .id = "coasting_driver",
      .name = "driver that lets go at zero",
      .stage = Stage::driver,
      .equation = "asked for 0 V: i_a = 0 and e_a = K_b omega",
      .what =
          "Asked for nothing, the driver opens its switches: the motor coasts. The model has it shorted, which brakes.",
      .shows = "The motor takes longer to stop than to reach its speed, and no current flows while it does.",
      .told_apart =
          "From one_quadrant_driver by a step down to a voltage that is not zero, where it brakes; from friction that "
          "is too large by rising edges.",
      .source = "Data sheets of bridges: L298, TB6612, DRV8871: coast, fast stop or stop with both inputs low",
      .parameter_count = 0,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar>, Balance<Scalar>& balance) {
    balance.lets_go = true;
  }
};

}  // namespace emtb
