#pragma once

#include <span>
#include <string>

#include "experiment/profile.h"

namespace emtb {

/// Up to the level at `rate` [V/s], held, and the reference gone at once: the motor runs down by its losses, where the
/// driver lets it (one quadrant, or the armature opened).
Profile coast_down(std::string name, double level, double rate, double before, double hold, double after,
                   double rest = 0);

/// +level, -level, +level ..., `times` reversals, each held. For drivers of two directions.
Profile reversal(std::string name, double level, int times, double before, double hold, double after, double rest = 0);

/// A sine about `offset` [V] whose frequency grows evenly in its logarithm from f0 to f1 [Hz] in `total` [s].
/// Straight between 40 points a period: 0.3 % of the amplitude off at most.
/// @throws ConfigError where that is more than most_levels points
Profile chirp(std::string name, double offset, double amplitude, double f0, double f1, double before, double total,
              double after, double rest = 0);

/// The level for `total` [s], with a dip to another level for `dip` [s] every `every` [s]: as it warms, each dip tells
/// R_a and K_b apart anew.
Profile heat_soak(std::string name, double level, double low, double every, double dip, double before, double total,
                  double after, double rest = 0);

/// Values at times; between two of them the first is held.
Profile held(std::string name, std::span<const double> t, std::span<const double> value);

}  // namespace emtb
