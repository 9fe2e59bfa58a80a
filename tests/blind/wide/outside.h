#pragma once

#include <vector>

#include "tests/blind/hidden.h"
#include "tests/blind/wide/bench.h"

/// What no library has a name for, at any scale.
namespace emtb::blind::wide::outside {

using Nothing = std::vector<TrueParameter>;  ///< nobody can estimate these

Nothing friction_bump(WideBench& bench, double size, Draw draw);    ///< a bearing that rubs more at one speed
Nothing sector_friction(WideBench& bench, double size, Draw draw);  ///< a shaft that rubs over a part of each turn
Nothing shaking(WideBench& bench, double size, Draw draw);          ///< a neighbour's machine
Nothing flux_hysteresis(WideBench& bench, double size, Draw draw);  ///< iron that remembers the current
Nothing tacho_coupling(WideBench& bench, double size, Draw draw);   ///< sticks, then slips
Nothing brush_bounce(WideBench& bench, double size, Draw draw);     ///< brushes that lift at speed
Nothing random_brake(WideBench& bench, double size, Draw draw);     ///< somebody leans on the shaft now and then

}  // namespace emtb::blind::wide::outside
