#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "analysis/numerics/orders.h"
#include "analysis/record/record.h"

namespace emtb {

/// [s] The shortest stretch that tells a scatter: a part of the run, for that lasts as long as its machine needs, and
/// so many readings that what repeats with the angle may be told from noise; a second is enough.
double settled_stretch(std::span<const double> t);

inline constexpr std::size_t fewest_readings = 5;

/// Times the standard deviation: a bridge that chops is so much louder than one that is idle.
inline constexpr double clearly_louder = 2;

/// The input that drives a run: the reference, or else what is measured of the circuit.
const std::vector<double>& input_of(const Excitation& excitation);

/// The pieces of a signal in which nothing changes but noise, and what repeats with the angle or in time.
struct SettledPieces {
  std::vector<TurningStretch> fast;
  std::vector<std::vector<double>> time;  ///< [s] of the fast ones' readings
  std::vector<char> driven;               ///< of the fast ones: is the input other than nothing?
  std::vector<std::vector<double>> slow;
  std::vector<std::vector<double>> short_slow;  ///< pieces of a slow meter that may be too short to tell a trend
};

/// Collects the settled pieces of one observation.
void collect(const ObservedRun& record, const Observation& o, SettledPieces& settled);

/// Leaves out the pieces at rest, where there are others, of a speed that is made of counts: at rest nothing is
/// counted. Of other speeds those that do not vary at all.
void leave_out_rest(SettledPieces& settled, bool counts);

/// Leaves out the pieces in which nothing is driven, where those that are scatter clearly more from reading to reading.
void leave_out_idle(SettledPieces& settled);

/// Takes out of the settled pieces what repeats with the angle or, slower than any hum of the mains, in time: that is
/// no noise, something shakes the machine.
void remove_what_repeats(SettledPieces& settled);

}  // namespace emtb
