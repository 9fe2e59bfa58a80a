#pragma once

#include <span>

#include "analysis/check/finding.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// A reference that asks for more than twice what the model's driver gives at most: it may be in another unit, or a
/// code that means something else, as a brake. A controller may ask for as much, so it is a remark.
DataFindings beyond_driver(std::span<const Run> runs, const Model& model);

}  // namespace emtb
