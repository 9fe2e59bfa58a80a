#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The field of the armature current, which saturates one pole tip more than it relieves the other.
struct ArmatureReaction {
  static constexpr EffectInfo info{
      .id = "armature_reaction",
      .name = "armature reaction",
      .stage = Stage::air_gap,
      .equation = "K_b, K_m -> K (1 - k_i x^2/(1 + x^2)), x = i_a/i_k",
      .what = "Under load the armature's own field weakens that of the poles.",
      .shows = "Torque and back-EMF constants fall with the current.",
      .told_apart = "From R_a, which costs speed but no torque for the current; from windage by load at low speed.",
      .source = "Krause, Wasynczuk and Sudhoff, Analysis of Electric Machinery; even, with a knee",
      .parameter_list =
          {{{.symbol = "k_i", .unit = "1", .null = 0, .min = 0, .max = 0.5, .typical = 0.1},
            {.symbol = "i_k", .unit = "A", .null = 1, .min = 1e-6, .max = 1e4, .typical = 1, .role = Role::shape}}},
      .parameter_count = 2};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    std::tie(balance.reaction, balance.reaction_knee) = std::tie(p[0], p[1]);  // implicit: see flux_left()
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double share : {0.1, 0.3, 1.0}) all.push_back({0, share * seen.current});
    return all;
  }

  /// The knee lies where the current goes.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(1, 0.01 * machine.seen.current, "a hundredth of the current: below, K is another constant")
        .at_most(1, 10 * machine.seen.current, "ten times the current: only its first bend would show");
  }
};

}  // namespace emtb
