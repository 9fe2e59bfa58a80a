#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A current that is read in the lead of the supply, in front of the bridge that chops it.
struct SupplyCurrent {
  static constexpr EffectInfo info{
      .id = "supply_current",
      .name = "current read at the supply",
      .stage = Stage::sensors,
      .equation = "reading = i_a |e_a|/V_s",
      .what =
          "The sensor is in front of the bridge. The supply gives its current only while the bridge is on, for "
          "|e_a|/V_s "
          "of the time; power in is power out.",
      .shows = "At half of the voltage half of the current is read: at standstill as well as under way.",
      .told_apart =
          "From coulomb_friction, which takes the same current at all speeds, and from driver_output_resistance by the "
          "voltage at the terminals.",
      .source = "Erickson and Maksimovic, Fundamentals of Power Electronics, ch. 3: the converter as a transformer",
      .parameter_list =
          {{{.symbol = "V_s", .unit = "V", .null = 24, .min = 1e-3, .max = 1e4, .typical = 24, .role = Role::supply}}},
      .at_null = AtNull::nothing,
      .reads = Signal::i_a,
      .bench = {.voltage = true, .current = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& V_s = p[0];
    balance.i_a_reading += x.i_a * (abs(x.e_a) / V_s - 1.0);
  }

  static std::vector<StartValues> starts(const Ranges& seen) { return {{seen.supply}}; }

  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).supply(0, machine.seen);
  }
};

}  // namespace emtb
