#pragma once

#include "model/effect.h"
#include "model/machine/armature.h"
#include "model/machine/equations.h"
#include "model/structure.h"

namespace emtb {

/// Which way a driver that takes no current back lets one flow: 1 or -1, as its voltage drives it; asked for nothing as
/// it did, 0 where none did.
inline double way_of_current(const DriverModel& driver, double voltage, double current) {
  if (driver.min >= 0) return 1;
  const double of = voltage != 0 ? voltage : current;
  return of > 0 ? 1 : of < 0 ? -1 : 0;
}

/// Does the driver let no current flow at the end of a step: since it is asked for nothing, or since that would flow
/// against its voltage? What flows against it already, in an inductance, goes on until it is gone.
/// @param source [V] mean over the step
template <class Scalar>
bool blocks(const DriverModel& driver, const Balance<Scalar>& terms, const Armature<Scalar>& armature,
            const Motion<Scalar>& motion, const Scalar& source, bool asked) {
  if (terms.lets_go && !asked) return true;
  if (!terms.one_quadrant) return false;
  const double way = way_of_current(driver, value_of(source), value_of(motion.i_a));
  if (armature.inductive() && way * value_of(motion.i_a) < 0) return false;
  return way * value_of(armature.stopping_voltage(source, motion)) <= 0;
}

}  // namespace emtb
