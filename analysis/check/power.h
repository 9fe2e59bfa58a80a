#pragma once

#include "analysis/check/balance.h"
#include "analysis/check/finding.h"

namespace emtb {

/// Signals that count the other way round, by the signs of power and of the balances: of a motor that is driven from
/// rest, the means of e_a ω, e_a i_a and i_a ω are above zero, and so are R, K and the inertia. One signal that is
/// turned round turns two of the three. A current that has no sign at all is told first (lost_sign.h).
/// @param run as the finding names it
DataFindings turned_signs(const MotionWindows& windows, const MotorBalance& balance, const std::string& run,
                          double duration);

}  // namespace emtb
