#pragma once

#include <vector>

#include "analysis/check/windows.h"

namespace emtb {

/// A coefficient of a regression over windows, and how surely it is one.
struct Share {
  double value = 0;
  double t = 0;        ///< in its standard errors
  double partial = 0;  ///< correlation with what the other columns leave

  bool sure() const { return t > 10 && partial > 0.5; }
};

/// The balances of voltage and of torque over windows, by least squares with a constant:
///
///     e_a = R i_a + K ω + c            i_a = a dω/dt + b ω + d T + c
///
/// Friction, offsets and a brush drop end in the constant, or in b. What a run does not hold stays zero.
struct MotorBalance {
  Share resistance, back_emf;           ///< R [ohm], K [V s/rad]
  Share inertia, viscous, torque;       ///< a [A s2/rad], b [A s/rad], d [A/(N m)]
  double power_in = 0, back_power = 0;  ///< mean of e_a i_a and of i_a ω, each over the product of the rms
  double driven = 0;                    ///< of e_a ω, likewise
  double sped_up = 0;                   ///< of e_a dω/dt, likewise
  double pulled = 0;                    ///< of i_a dω/dt, likewise
  double gain = 0;                      ///< [V s/rad] mean of e_a ω over that of ω^2: K or more, by friction
};

MotorBalance balance_of(const MotionWindows& w);

/// The balance of voltage as it can be held against that of another run: what goes with the direction of motion alone,
/// as a brush drop or a dead zone, is no part of it.
///
///     e_a = R i_a + K ω + V sign(ω) + c            or, without a current,  e_a = K ω + a dω/dt + V sign(ω) + c
struct MotorConstants {
  Share resistance;  ///< R [ohm]; zero without a current
  Share back_emf;    ///< K [V s/rad]; without a current with what viscous friction adds
};

MotorConstants constants_of(const MotionWindows& w);

}  // namespace emtb
