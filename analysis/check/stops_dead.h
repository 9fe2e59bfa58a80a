#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// A shaft that turns at speed in one row and rests in the next, again and again, though it takes several rows to get
/// there: the rows between were cut out, or recordings were put one behind the other. Something that the shaft runs
/// into stops it like that as well: a remark.
DataFindings stops_dead(const Run& run);

}  // namespace emtb
