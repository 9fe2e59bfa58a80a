#pragma once

#include "analysis/estimate/settled.h"
#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// Shaft torque against speed, as section 3.2 of Erdal et al. (2011) finds B and T_L: T_m = B ω + T_L. The gauge sees
/// the load alone, so the line belongs to the load, or to the machine's own speed-torque line, never to the friction
/// inside the motor: at one voltage its slope is -(K_m K_b/R_a + B), at one setting of the brake the brake's. Gives
/// `slope` [N m s/rad] and `intercept` [N m].
StaticEstimate estimate_load_line(const Settled& settled);

/// The friction inside the motor: K_m i_a - torque = B ω + T_c through settled points at several speeds. Without a
/// gauge the shaft is taken as free. Gives B [N m s/rad] and T_c [N m].
StaticEstimate estimate_friction(const Settled& settled, const KnownParameters& known);

/// Shaft torque against current, as section 3.3: torque = K_m i_a - T_0. The slope is K_m [N m/A] in the gauge's units,
/// the intercept -T_0 [N m] the whole no-load loss.
StaticEstimate estimate_torque_constant(const Settled& settled);

}  // namespace emtb
