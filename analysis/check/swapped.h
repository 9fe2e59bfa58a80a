#pragma once

#include <string>

#include "analysis/check/balance.h"
#include "analysis/check/finding.h"

namespace emtb {

/// The columns of e_a and i_a, each named as the other. What a motor makes of i_a = e/R - K/R ω then reads as a voltage
/// that falls with the speed that it drives.
/// @param duration [s] of the run
DataFindings swapped(const MotionWindows& w, const MotorBalance& b, const std::string& run, double duration);

}  // namespace emtb
