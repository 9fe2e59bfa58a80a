#pragma once

#include "analysis/check/finding.h"
#include "session/session.h"

namespace emtb {

/// Signals that stop updating while their own noise or other signals say that they should change, and signals that are
/// updated more slowly than they are written.
DataFindings held(const Run& run);

}  // namespace emtb
