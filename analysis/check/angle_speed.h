#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// The angle against the integral of the speed, where both are measured: factor, sign, delay, and whether they are of
/// one motion at all.
///
/// Increments of the angle over short windows are held against those of the integral, moved to and fro in time until
/// they agree best; a drift, as an offset of the speed makes it, is the same in all windows and does little.
DataFindings angle_against_speed(const Run& run);

}  // namespace emtb
