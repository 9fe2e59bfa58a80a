#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// Signals that rest at their extreme where they would have gone on: beyond the instrument's range.
DataFindings clipped(const Run& run);

}  // namespace emtb
