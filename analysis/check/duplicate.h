#pragma once

#include <span>

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// Runs that hold the same readings, whatever they are called: rows of several signals in the same order.
DataFindings duplicates(std::span<const Run> train, std::span<const Run> held_out);

}  // namespace emtb
