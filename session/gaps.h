#pragma once

#include <span>
#include <vector>

#include "session/session.h"

namespace emtb {

/// A time without readings between two that are there.
struct Gap {
  double from = 0, to = 0;  ///< [s]
};

/// The gaps of a series of times: where the next reading comes later than ten usual intervals, three times what one
/// interval in a hundred exceeds, and 50 ms. What is lost in less is bridged by an input that stays as it was.
std::vector<Gap> gaps(std::span<const double> t);

/// The spans of a run between gaps in what drives the motor, of ten readings or more: half open, the last without an
/// end. One span without a gap.
std::vector<Gap> spans_between_gaps(const Run& run, Signal input);

/// A run as pieces that have no gap in what drives the motor; what happened in a gap is not known, so each piece starts
/// from a state of its own. Pieces of fewer than ten readings are dropped. A run without a gap stays as it is.
std::vector<Run> split_at_gaps(const Run& run, Signal input);
std::vector<Run> split_at_gaps(const std::vector<Run>& runs, Signal input);

}  // namespace emtb
