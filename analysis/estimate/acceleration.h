#pragma once

#include <span>

#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// Inertia from any acceleration: K_m ī - torque = J Δω/Δt + B ω̄ + T_c, where a bar is a mean over Δt: exact for a
/// meter that averages. The windows are the meter's own, or 0.1 s where the current is fast. Gives J [kg m2], B and
/// T_c.
StaticEstimate estimate_acceleration(std::span<const Run> runs, const KnownParameters& known);

}  // namespace emtb
