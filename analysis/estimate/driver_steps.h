#pragma once

#include <span>

#include "analysis/estimate/settled.h"
#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// The driver's static characteristic: e_a = gain u_ref + offset through settled points. Gives gain [V/V] and offset
/// [V]; where the line meets zero above u_ref = 0, the dead zone [V]. Points at the driver's upper end, where e_a no
/// longer grows with u_ref, are left out.
StaticEstimate estimate_driver_gain(const Settled& settled);

/// How fast the driver follows, as figure 8 of Erdal et al. (2011): lines through e_a between 10 and 90 % of each
/// transition that a step of u_ref causes. Gives rise and fall [V/s].
StaticEstimate estimate_driver_slopes(std::span<const Run> runs);

}  // namespace emtb
