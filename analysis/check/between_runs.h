#pragma once

#include <span>
#include <vector>

#include "analysis/check/finding.h"
#include "analysis/check/windows.h"
#include "session/session.h"

namespace emtb {

/// Scales that differ between runs: R_a and K_b of one motor are the same in all of them, but for heat, brushes and the
/// like, which change neither severalfold.
/// @param windows of each run, in their order
DataFindings scales_between_runs(std::span<const Run> runs, std::span<const MotionWindows> windows);

}  // namespace emtb
