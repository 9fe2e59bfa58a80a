#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The filter behind a tachogenerator.
struct TachoLag {
  static constexpr EffectInfo info{
      .id = "tacho_lag",
      .name = "tachogenerator lag",
      .stage = Stage::sensors,
      .equation = "tau dy/dt = omega - y, y is read",
      .what = "The filter that takes the ripple off the tachogenerator makes its reading late.",
      .shows = "The speed is late against the current whenever it changes; nothing when settled.",
      .told_apart = "From armature_inductance by current in transients; from J by the current.",
      .source = "first-order filter; Leonhard, Control of Electrical Drives",
      .parameter_list = {{{.symbol = "tau", .unit = "s", .null = 0, .min = 0, .max = 10, .typical = 0.03}}},
      .memory = 3,
      .family = Family::late_speed,
      .reads = Signal::omega,
      .bench = {.tachogenerator = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Memory<Scalar> memory, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& tau = p[0];
    lag_reading(tau, x.h, memory.first(2), balance.omega_reading);
    if (x.h == 0) memory[2] = memory[0];
    balance.angle_behind += tau * (memory[0] - memory[2]);
  }

  /// What is slower than the runs reads no speed.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(0, machine.seen.logged_lag, "within which it is how the runs were logged")
        .at_most(0, 0.2 * machine.seen.duration, "a fifth of the longest run");
  }
};

}  // namespace emtb
