#pragma once

#include <span>
#include <string>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/plausible.h"

namespace emtb {

/// A speed or an angle that is old when it is read: it came over a bus, or waited for its turn.
struct SpeedDelay {
  static constexpr EffectInfo info{
      .id = "speed_delay",
      .name = "late speed",
      .stage = Stage::sensors,
      .equation = "reading(t) = omega(t - t_d); an encoder's angle likewise",
      .what = "A servo measures, then waits until it is asked over its bus; a log stamps what arrives.",
      .shows = "Speed and angle are late as a whole whenever they change; nothing when settled.",
      .told_apart =
          "From tacho_lag by the corners of the speed, which stay sharp; from driver_delay by the current or e_a, "
          "which are in time.",
      .source = "dead time of a sampled bus; Leonhard, Control of Electrical Drives, on sampled measurements",
      .parameter_list = {{{.symbol = "t_d", .unit = "s", .null = 0, .min = 0, .max = 2, .typical = 0.03}}},
      .at_null = AtNull::small,
      .family = Family::late_speed,
      .in_time = true,
      .reads = Signal::omega};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const Scalar& t_d = p[0];
    balance.reading_delay += t_d;
  }

  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    for (const double time : seen.edge_times()) all.push_back({time});
    return all;
  }

  /// What is older than that no run tells.
  static std::string implausible(std::span<const double> p, const FittedMachine& machine) {
    return Plausible(info, p)
        .at_least(0, machine.seen.logging, "within which it is how the runs were logged")
        .at_most(0, 0.2 * machine.seen.duration, "a fifth of the longest run");
  }
};

}  // namespace emtb
