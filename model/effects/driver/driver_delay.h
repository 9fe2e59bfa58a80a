#pragma once

#include <vector>

#include "model/dual.h"
#include "model/effect.h"

namespace emtb {

/// The time before a driver answers at all.
struct DriverDelay {
  static constexpr EffectInfo info{
      .id = "driver_delay",
      .name = "driver delay",
      .stage = Stage::driver,
      .equation = "e(t) = e_in(t - t_d)",
      .what =
          "A digital bridge computes before it acts; a line-commutated one waits for its next firing, on the mean half "
          "a pulse.",
      .shows = "Edges are shifted as a whole; nothing when settled. Excited by steps.",
      .told_apart =
          "From driver_lag by the shape of the edge: shifted, not rounded. Half a sample of timing error in the data "
          "looks the same.",
      .source = "Leonhard, Control of Electrical Drives: T/(2p) on the mean",
      .parameter_list = {{{.symbol = "t_d", .unit = "s", .null = 0, .min = 0, .max = 2, .typical = 0.03}}},
      .at_null = AtNull::small,
      .family = Family::driver_edges,
      .bench = {.driver = true}};

  template <class Scalar>
  static void apply(Parameters<Scalar> p, const State<Scalar>&, Balance<Scalar>& balance) {
    const Scalar& t_d = p[0];
    balance.delay += t_d;
  }

  /// None, and from a sample of a fast loop to a slow machine's, in s.
  static std::vector<StartValues> starts(const Ranges&) { return {{0.0}, {0.001}, {0.003}, {0.01}, {0.03}, {0.1}}; }
};

}  // namespace emtb
