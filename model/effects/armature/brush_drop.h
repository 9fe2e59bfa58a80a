#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The voltage that the contact between brush and commutator takes. It grows up to the current i_lin, about a hundredth
/// of the rated one.
struct BrushDrop {
  static constexpr EffectInfo info{
      .id = "brush_drop",
      .name = "brush contact drop",
      .stage = Stage::armature,
      .equation = "e_a = R_a i_a + K_b omega + V_b tanh(i_a / i_lin)",
      .what = "Carbon brushes drop a voltage that hardly depends on the current, once one flows.",
      .shows =
          "A constant voltage is missing at any current; R_a comes out too large at light load, too small at full.",
      .told_apart =
          "From coulomb_friction by a fast current, or by current at two loads; from driver_dead_zone by a measured "
          "e_a, or by reversal.",
      .source = "Modelica Standard Library, Machines.Losses.DCMachines.Brush",
      .parameter_list = {{{.symbol = "V_b", .unit = "V", .null = 0, .min = 0, .max = 100, .typical = 1.5},
                          {.symbol = "i_lin",
                           .unit = "A",
                           .null = 0.01,
                           .min = 1e-6,
                           .max = 1e3,
                           .typical = 0.01,
                           .role = Role::shape}}},
      .parameter_count = 2,
      .opposes_motion = true,
      .watch = Watch{.rank = 3, .varies = false},
      .bench = {.voltage = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const auto& [V_b, i_lin] = std::tie(p[0], p[1]);
    balance.contact_drop += V_b;
    balance.contact_knee += i_lin;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.0005, 0.003, 0.02}) all.push_back({0, share * seen.current});
    return all;
  }

  static double size_at(double share, const Ranges& seen) { return share * seen.voltage; }

  /// A drop that is there from light load on.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_most(0, 0.5 * machine.seen.voltage, "half of the voltage")
        .at_most(1, 0.5 * machine.seen.current, "half of the current: beyond that it is a resistance");
  }
};

}  // namespace emtb
