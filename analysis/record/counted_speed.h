#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "session/session.h"

namespace emtb {

/// How a logged speed comes of an encoder's counts: counts × step / time.
struct CountedSpeed {
  double step = 0;             ///< [rad] of the encoder
  bool measured_time = false;  ///< divided by the time between two rows; else by the time that is usual
  std::size_t rows = 1;        ///< of whose counts each reading is the mean
  double kept = 0;             ///< of the last reading, by a logger that smooths (smoothed_speed.h)
};

/// Whether the speeds of runs are differences of counts; none where an instrument measured them.
///
/// All of its values times the time between them are whole multiples of a step. Where rows last unlike long, and each
/// value counts by the length of its own, that is proof. Else a coarse converter does as much, so that more has to
/// speak for counts. A turn is a whole number of steps, and steady stretches show no more noise than whole counts make;
/// brief ones will do where it is so to a thousandth and the step is no round number of rpm, say; neither where one
/// step a row is the last digit of a display, as one rpm is. Or the counts add up: of a counter the sum over any time
/// is right to a count, whereas noise that hops between two codes adds up like a walk, from one reading to the fourth
/// as well as over long steady pieces.
///
/// A logger that writes the mean of its last n rows writes multiples of an n-th of the step: an encoder n times as
/// fine, which it is not. From a run that begins at rest the counts of each row come back to the last one: the mean
/// tells by how much they differ from those n rows before. Where these add up, they are taken. So are the counts that
/// a logger has smoothed.
/// @param others that were logged alike
std::optional<CountedSpeed> counted_speed(std::span<const Run> runs, std::span<const Run> others = {});

/// The runs with the angle that was counted in place of the speed that was made of it: nothing is lost, and what
/// neighbours share of a count's error is known (count_errors.h).
std::vector<Run> with_counted_angle(std::span<const Run> runs, const CountedSpeed& counted);

}  // namespace emtb
