#pragma once

#include <optional>
#include <string>
#include <vector>

#include "session/session.h"

namespace emtb {

/// What is known of driver and motor before anything has turned. Absent: not known, and not checked.
struct SpinExpectation {
  double u_ref = 0;                     ///< [V] held from `from` to `to`
  double from = 0, to = 0;              ///< [s]
  std::optional<double> R_a{};          ///< [ohm]
  std::optional<double> K_b{};          ///< [V s/rad]
  std::optional<double> driver_gain{};  ///< [V/V]
  /// Relative, by which voltage and speed may differ. By hand: a nameplate's R_a and K_b are off by as much.
  double tolerance = 0.25;
};

/// What a first spin showed.
struct SpinVerdict {
  std::vector<std::string> measured;  ///< one line a signal, for people
  std::vector<std::string> wrong;     ///< which wire or scale, and what to do; empty: all is well
  std::vector<std::string> unknown;   ///< what could not be checked, and why
};

/// Checks signs and scales of e_a, i_a and omega on a run that stands, turns at a low voltage, and stands again.
///
/// Means over the last half of the hold against those before it: e_a against driver_gain u_ref; omega against
/// (e_a - R_a i_a) / K_b; i_a by its sign and by R_a i_a < e_a, which holds for every motor that is driven. The scale
/// of a current that is too small cannot be seen without a load: that is said.
SpinVerdict judge_first_spin(const Run& run, const SpinExpectation& expected);

}  // namespace emtb
