#pragma once

#include <string>

#include "analysis/check/finding.h"
#include "analysis/check/windows.h"

namespace emtb {

/// Does a current never go below zero, but for an offset and noise?
bool never_below_zero(const MotionWindows& windows);

/// A current of a motor that is driven both ways, of which only the size was logged: it is never negative, and goes
/// with what the shaft does only once it is given the sign of the voltage. A load that pulls one way makes a current
/// that is never negative, too, but that goes with the shaft as it stands.
/// @param run as the finding names it
DataFindings lost_sign(const MotionWindows& windows, const std::string& run, double duration);

/// A drive of which only the size was logged, as the duty of a bridge that is reversed by other pins: it is never
/// negative, and the shaft turns both ways under it. A weight that a motor lets down does the same: a remark.
DataFindings drive_without_sign(const MotionWindows& windows, const std::string& run, double duration);

}  // namespace emtb
