#pragma once

#include "tests/blind/wide/wide_case.h"

namespace emtb::blind::wide {

/// Spoils the first training run (or hands a run out twice) as people do, in a way drawn by lot.
Garbage plant_garbage(WideCase& c, Draw& draw);

}  // namespace emtb::blind::wide
