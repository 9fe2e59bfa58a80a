#pragma once

#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A bridge that chops its supply and lets the current run on through diodes: a motor at light load takes its current
/// in pulses, and the mean voltage bends.
struct PwmDrive {
  static constexpr EffectInfo info{
      .id = "pwm_drive",
      .name = "current with gaps under PWM",
      .stage = Stage::driver,
      .equation =
          "e_a = D V_s - d k V_s + (1 - D - d) E, "
          "d = min(ln(1 + (V_s - E) (1 - exp(-r D))/(k V_s + E))/r, 1 - D)",
      .what =
          "The supply is on for D = |e|/V_s of a period of r L_a/R_a; then the current runs on through diodes, "
          "against k V_s, and ends before the next. E is the back-EMF.",
      .shows =
          "Speed bends over the reference at light load: too high with free-running current, too low against the "
          "supply. The motor coasts where less is asked for.",
      .told_apart =
          "From driver_dead_zone and driver_saturation by its bend at all levels; from discontinuous_conduction, "
          "a rectifier's, by half duty; from one_quadrant_driver by its bend.",
      .source = "Erickson and Maksimovic, Fundamentals of Power Electronics, ch. 5: discontinuous conduction, with R_a",
      .parameter_list =
          {{{.symbol = "r", .unit = "1", .null = 1, .min = 0.01, .max = 1e3, .typical = 1, .role = Role::shape},
            {.symbol = "V_s", .unit = "V", .null = 24, .min = 1e-3, .max = 1e4, .typical = 24, .role = Role::supply},
            {.symbol = "k", .unit = "1", .null = 0, .min = 0, .max = 1, .typical = 0.1, .role = Role::shape}}},
      .parameter_count = 3,
      .at_null = AtNull::nothing,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const auto& [r, V_s, k] = std::tie(p[0], p[1], p[2]);
    balance.chop_period += r;
    balance.chop_supply += V_s;
    balance.chop_decay += k * V_s;
  }

  /// A quick and a slow chopper, behind which the current runs on freely, or back into the supply.
  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double r : {0.5, 3.0}) {
      for (const double against : {0.0, 1.0}) all.push_back({r, seen.supply, against});
    }
    return all;
  }

  /// Of a supply that the reference goes up to. Its period may be as short as it likes: then the motor coasts.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p).supply(1, machine.seen);
  }
};

}  // namespace emtb
