#pragma once

#include "analysis/record/record.h"

namespace emtb {

/// A record with only so many of its rows as its motor needs (set_steps()): for questions to instruments that are no
/// quicker than the shaft. Readings of single rows are kept where their row is; other readings are left out.
Record thinned(const Record& record);

}  // namespace emtb
