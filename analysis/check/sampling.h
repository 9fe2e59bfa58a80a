#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// Times without readings, and rows that come unevenly.
DataFindings sampling_flaws(const Run& run);

}  // namespace emtb
