#pragma once

#include "model/dual.h"

namespace emtb {

/// [rad/s] The speed at the end of a step in which dry friction opposes the motion. A shaft that stops on the way stays
/// where nothing pulls more than that holds, or is pulled back for the rest of the step: friction has then turned round
/// with it, not before.
/// @param omega at the start @param pushed at the end, without friction @param friction what it takes in a step
template <class Scalar>
Scalar speed_against_friction(const Scalar& omega, const Scalar& pushed, const Scalar& friction) {
  const double began = value_of(omega);
  if (began == 0) return soft_threshold(pushed, friction);
  const Scalar against = began > 0 ? friction : -friction;
  const Scalar going_on = pushed - against;
  if (!(value_of(going_on) * began < 0)) return going_on;  // also where it is no number
  const Scalar share_before = omega / (omega - going_on);  // of the step
  const Scalar turned = pushed + against * (1.0 - 2.0 * share_before);
  return value_of(turned) * began < 0 ? turned : Scalar(0.0);
}

}  // namespace emtb
