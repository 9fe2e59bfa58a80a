#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// Single readings that stand far off both neighbours, while these agree.
DataFindings spikes(const Run& run);

}  // namespace emtb
