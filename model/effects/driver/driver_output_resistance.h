#pragma once

#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// An output that sags under load.
struct DriverOutputResistance {
  static constexpr EffectInfo info{
      .id = "driver_output_resistance",
      .name = "driver output resistance",
      .stage = Stage::driver,
      .equation = "e_a = e - R_o i_a",
      .what = "Windings, switches and cables between the regulated voltage and the motor take their share.",
      .shows = "e_a sags in proportion to the current.",
      .told_apart = "From R_a by a measured e_a alone: without it they are one.",
      .source = "Thevenin; Leonhard, Control of Electrical Drives",
      .parameter_list = {{{.symbol = "R_o", .unit = "ohm", .null = 0, .min = 0, .max = 1e4, .typical = 3}}},
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& R_o = p[0];
    balance.output_resistance += R_o;
  }

  /// A driver that keeps more of the voltage than the motor gets would be no driver for it.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most(0, machine.R_a, "R_a");
  }
};

}  // namespace emtb
