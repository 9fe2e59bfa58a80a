#pragma once

#include "model/dual.h"
#include "model/effect.h"

namespace emtb {

/// The filter behind a strain gauge.
struct TorqueLag {
  static constexpr EffectInfo info{.id = "torque_lag",
                                   .name = "torque gauge lag",
                                   .stage = Stage::sensors,
                                   .equation = "tau dy/dt = T - y, y is read",
                                   .what = "The strain gauge's amplifier filters its signal.",
                                   .shows = "The torque reads late whenever it changes.",
                                   .told_apart = "From shaft_compliance by the absence of ringing.",
                                   .source = "first-order filter",
                                   .parameter_list = {{{.symbol = "tau", .unit = "s", .null = 0, .min = 0, .max = 10}}},
                                   .memory = 2};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
    lag_reading(p[0], x.h, memory, balance.torque_reading);
  }
};

}  // namespace emtb
