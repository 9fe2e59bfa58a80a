#pragma once

#include <span>
#include <string>
#include <tuple>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The ripple of a tachogenerator: its commutator's segments, its poles, or a shaft that runs out of true.
struct TachoRipple {
  static constexpr EffectInfo info{
      .id = "tacho_ripple",
      .name = "tachogenerator ripple",
      .stage = Stage::sensors,
      .equation = "reading = omega (1 + r sin(N theta + phase))",
      .what = "A tachogenerator's voltage ripples N times a turn, in proportion to the speed.",
      .shows = "The speed's reading ripples with the angle, the more the faster; the current does not.",
      .told_apart =
          "From cogging, whose ripple vanishes with speed, and from eccentric_load (N = 1), which the current shows.",
      .source = "Krause, Wasynczuk and Sudhoff, Analysis of Electric Machinery",
      .parameter_list =
          {{{.symbol = "r", .unit = "1", .null = 0, .min = 0, .max = 0.5, .typical = 0.01},
            {.symbol = "N", .unit = "1/turn", .null = 2, .min = 0.5, .max = 400, .typical = 2, .role = Role::order},
            {.symbol = "phase", .unit = "rad", .null = 0, .min = -7, .max = 7, .typical = 1, .role = Role::phase}}},
      .parameter_count = 3,
      .periodic = true,
      .reads = Signal::omega,
      .bench = {.tachogenerator = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const auto& [r, N, phase] = std::tie(p[0], p[1], p[2]);
    balance.omega_reading *= 1.0 + r * sin(N * x.theta + phase);
  }

  /// Even two segments rectify to less.
  static std::string implausible(std::span<const double> p, const FittedMachine&) {
    return Plausible(info, p).at_most(0, 0.3, "that of a tachogenerator at all");
  }
};

}  // namespace emtb
