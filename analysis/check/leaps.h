#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// One to three readings of a speed that no shaft can have had: beyond all that it reaches before and after, and left
/// within one row, faster than the shaft changes anywhere else, while what drives it stays. So an encoder begins that
/// divides its first counts by a time that was not theirs.
DataFindings leaps(const Run& run);

}  // namespace emtb
