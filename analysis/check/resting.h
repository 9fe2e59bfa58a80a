#pragma once

#include <span>

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// Signals that move in none of the runs, and those whose instrument is too coarse to follow them.
DataFindings resting(std::span<const Run> runs);

}  // namespace emtb
