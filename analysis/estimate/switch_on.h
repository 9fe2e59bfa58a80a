#pragma once

#include <span>

#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// Inertia from a switch-on, as section 3.4 of Erdal et al. (2011): J = K_m i_max / (dω/dt)_0, and net of the friction
/// torque where that is known. Gives i_max [A], dω/dt [rad/s2] (at the onset, by a cubic through the first half of
/// the rise) and J [kg m2].
///
/// Holds only where the full voltage is there at once: behind a driver that takes seconds the acceleration is the
/// driver's, e_a' / K_b. Such a run is refused, with the acceleration that its driver allows.
StaticEstimate estimate_switch_on(std::span<const Run> runs, const KnownParameters& known);

}  // namespace emtb
