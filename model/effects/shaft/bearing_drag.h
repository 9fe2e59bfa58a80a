#pragma once

#include <cmath>
#include <span>
#include <string>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// The lubricant that the rollers of a bearing push aside.
struct BearingDrag {
  /// [rad/s] below which the drag is taken as straight: of infinite slope at rest it could not be simulated.
  static constexpr double straight_below = 1e-3;

  static constexpr EffectInfo info{
      .id = "bearing_drag",
      .name = "bearing drag",
      .stage = Stage::shaft,
      .equation = "T = c_b sign(omega) |omega|^(2/3)",
      .what = "Rolling bearings churn their grease; the torque grows with speed, but less than in proportion.",
      .shows = "The friction curve bends down: B comes out too large at low speed and too small at high speed.",
      .told_apart =
          "From coulomb_friction by low speeds, at which it vanishes; from B by high ones; from windage, which bends "
          "up.",
      .source = "Palmgren (1959), Ball and Roller Bearing Engineering: speed-dependent part, f_0 (nu n)^(2/3) d_m^3",
      .parameter_list =
          {{{.symbol = "c_b", .unit = "N m (s/rad)^(2/3)", .null = 0, .min = 0, .max = any_torque, .typical = 1e-3}}},
      .opposes_motion = true,
      .brakes_by_speed = true};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>& x, Balance<Scalar>& balance) {
    const Scalar& c_b = p[0];
    balance.braking_torque += c_b * x.omega * pow(x.omega * x.omega + straight_below * straight_below, -1.0 / 6);
  }

  /// The motor reached its speed.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).at_most("its torque at speed", p[0] * std::pow(machine.seen.speed, 2.0 / 3),
                                      machine.stall_torque(), "N m", "what stalls the motor");
  }
};

}  // namespace emtb
