#pragma once

#include <span>

#include "session/session.h"

namespace emtb {

/// How far the times at which an encoder was read scatter about those that were written, standard deviation [s]: of a
/// logger that writes whole milliseconds, or of a busy computer. An angle is off by as much times the speed. 0 where
/// the times are as good as the counts.
///
/// Told while the shaft turns: what the angle scatters about a smooth motion, beyond what whole counts leave, and
/// alike in differences of the third, fifth and seventh order. A ripple of the shaft is not alike in these, unless it
/// alternates from reading to reading. Nor can the times be off by more than the last digit that was written, or than
/// they are uneven.
/// @param runs,others that were logged alike; of one whose step is not known nothing is told
double time_scatter(std::span<const Run> runs, std::span<const Run> others = {});

}  // namespace emtb
