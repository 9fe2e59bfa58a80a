#pragma once

#include "analysis/record/record.h"

namespace emtb {

/// A record with only so many of its rows as its motor needs (set_steps()): for questions to instruments that are no
/// quicker than the shaft. What was read between two rows is kept as its mean.
Record thinned(const Record& record);

}  // namespace emtb
