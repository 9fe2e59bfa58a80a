#pragma once

#include <span>

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// A reference that is exactly 0 in all runs though something drives the motor: it came from somewhere, so this one was
/// not wired or not written. A motor that only slows down, or that another one turns, is driven by nothing: there a
/// reference of 0 is right.
DataFindings dead_reference(std::span<const Run> runs);

}  // namespace emtb
