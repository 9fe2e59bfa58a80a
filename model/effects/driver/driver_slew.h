#pragma once

#include <tuple>
#include <vector>

#include "model/dual.h"
#include "model/effect.h"
#include "model/structure.h"

namespace emtb {

/// Slew limits of the driver that are not what the model believes.
struct DriverSlew {
  static constexpr EffectInfo info{
      .id = "driver_slew",
      .name = "driver slew limits",
      .stage = Stage::driver,
      .equation = "-fall <= de/dt <= rise, in place of the driver's known limits",
      .what = "The driver's output cannot change faster than this.",
      .shows = "Edges of e_a are steeper or flatter than the model's; nothing is wrong when settled.",
      .told_apart = "From driver_lag by edges that stay straight; from J where e_a is measured.",
      .source = "Erdal et al. (2011), figure 8: 22.5 and -20.4 V/s",
      .parameter_list = {{{.symbol = "rise",
                           .unit = "V/s",
                           .null = 1e12,
                           .min = 1e-3,
                           .max = 1e12,
                           .typical = 20,
                           .role = Role::limit},
                          {.symbol = "fall",
                           .unit = "V/s",
                           .null = 1e12,
                           .min = 1e-3,
                           .max = 1e12,
                           .typical = 20,
                           .role = Role::limit}}},
      .parameter_count = 2,
      .at_null = AtNull::small,
      .family = Family::driver_edges,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, Balance<Scalar>& balance) {
    const auto& [rise, fall] = std::tie(p[0], p[1]);
    balance.rise = rise;
    balance.fall = fall;
  }

  /// At the driver's known limits, and at shares of both; where none are known, so that the whole voltage takes from a
  /// row or two to a good part of a run.
  static std::vector<StartValues> starts(const Ranges& seen) {
    std::vector<StartValues> all;
    const bool unknown = seen.rise >= DriverModel::unlimited && seen.fall >= DriverModel::unlimited;
    if (unknown && seen.sample > 0 && seen.voltage > 0) {
      all.push_back({DriverModel::unlimited, DriverModel::unlimited});
      const double least = 1.5 * seen.sample, most = std::max(150 * seen.sample, 0.2 * seen.duration);  // [s]
      constexpr double apart = 3.5;
      const int count = 1 + static_cast<int>(std::ceil(std::log(most / least) / std::log(apart)));
      for (const double time : geometric(least, most, count)) {
        all.push_back({seen.voltage / time, seen.voltage / time});
      }
      return all;
    }
    for (const double share : {1.0, 0.6, 0.8, 0.9, 1.1, 1.25, 1.6})
      all.push_back({share * seen.rise, share * seen.fall});
    return all;
  }
};

}  // namespace emtb
