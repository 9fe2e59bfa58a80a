#pragma once

#include <span>

#include "session/session.h"

namespace emtb {

/// Writes what is set from outside into every row from its first value on, where a log holds it only at times of its
/// own, as one of events does: a reference holds until the next.
void hold_references(std::span<Run> runs);

}  // namespace emtb
