#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// The angle against the integral of the speed, where both are measured: factor, sign, delay, and whether they are of
/// one motion at all.
///
/// Increments of the angle over short windows are held against those of the integral, moved to and fro in time until
/// they agree best. A drift, as an offset of the speed makes it, is the same in all windows: where the slope of a line
/// through the increments is right, there is no gear between the two.
DataFindings angle_against_speed(const Run& run);

/// [rad/s] What the speed reads while the angle stands: that of the line through the increments of both. 0 where only
/// one of them is measured, or they are not of one motion at one scale.
double speed_read_at_rest(const Run& run);

}  // namespace emtb
