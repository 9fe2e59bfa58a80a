#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// An angle that leaps once, from one row to the next, many times as far as it goes in any other row: its counter was
/// set, or the first rows were written before it was read. No shaft does so, and all that follows is off by as much.
DataFindings angle_leaps(const Run& run);

}  // namespace emtb
