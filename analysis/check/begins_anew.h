#pragma once

#include <span>

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// An angle that begins anew with each turn: remarked where it was put together (session/unwind.h), a flaw where
/// nothing tells how far the shaft turned from row to row.
DataFindings begins_anew(std::span<const Run> runs);

}  // namespace emtb
