#pragma once

#include "model/effect.h"
#include "model/machine/armature.h"
#include "model/machine/equations.h"
#include "model/structure.h"

namespace emtb {

/// Which way a driver that takes no current back lets one flow: 1 or -1, as its voltage drives it; 0 for none, where it
/// gives no voltage. One that only gives voltages above zero has a diode in which the current runs on.
inline int way_of_current(const DriverModel& driver, double voltage) {
  if (driver.min >= 0) return 1;
  return voltage > 0 ? 1 : voltage < 0 ? -1 : 0;
}

/// Does the driver let no current flow at the end of a step: since it is asked for nothing, or since that would flow
/// against its voltage? What flows its way already, in an inductance, goes on until it is gone; what flows against it
/// dies at once, against the supply.
/// @param source [V] mean over the step
template <class Scalar>
bool blocks(const DriverModel& driver, const Balance<Scalar>& terms, const Armature<Scalar>& armature,
            const Motion<Scalar>& motion, const Scalar& source, bool asked) {
  if (terms.lets_go && !asked) return true;
  if (!terms.one_quadrant) return false;
  const int way = way_of_current(driver, value_of(source));
  const double driving = way * value_of(source - armature.k_b() * motion.omega_in_middle());
  return driving <= 0 && way * value_of(armature.stopping_voltage(source, motion)) <= 0;
}

}  // namespace emtb
