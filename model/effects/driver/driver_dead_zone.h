#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A reference that is too small to be obeyed: what is left of it beyond u_d drives the output.
struct DriverDeadZone {
  static constexpr EffectInfo info{
      .id = "driver_dead_zone",
      .name = "driver dead zone",
      .stage = Stage::driver,
      .equation = "u -> sign(u) max(|u| - u_d, 0)",
      .what = "The driver ignores the first part of its reference.",
      .shows = "e_a lacks a constant voltage once the motor moves, nothing at zero; the motor starts late.",
      .told_apart =
          "From driver_gain_error by small references; from brush_drop by e_a or by reversal; from "
          "coulomb_friction by the current.",
      .source = "Kara and Eker (2004), Nonlinear modeling and identification of a DC motor for bidirectional operation",
      .parameter_list = {{{.symbol = "u_d", .unit = "V", .null = 0, .min = 0, .max = 1000, .typical = 0.1}}},
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& u_d = p[0];
    balance.u = soft_threshold(balance.u, u_d);
  }

  /// A zone as wide as what was asked for would have left nothing to record.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, 0.98 * machine.seen.reference, "the largest reference");
  }
};

}  // namespace emtb
