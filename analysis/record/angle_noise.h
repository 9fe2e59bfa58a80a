#pragma once

#include <span>

#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// By what the readings of an angle are off beyond what whole steps of its instrument leave.
struct AngleNoise {
  double still = 0;  ///< [rad] standard deviation at rest
  double times = 0;  ///< [s] standard deviation of the times at which it was read, see time_scatter()

  double variance(double speed) const { return still * still + times * times * speed * speed; }  ///< [rad²]
};

/// What runs tell of both; the first one as the model declares it, where it declares a noise of the angle.
/// @param runs,others that were logged alike; of one whose step is not known nothing is told
AngleNoise angle_noise(const Model& model, std::span<const Run> runs, std::span<const Run> others = {});

/// How much the readings of an angle scatter beyond what whole steps of its instrument leave, standard deviation [rad].
/// 0 for an encoder, which is silent at rest. A potentiometer is not.
///
/// Told where the shaft rests: in pieces whose readings hop and yet range no further than such hops explain.
double scatter_at_rest(std::span<const Run> runs, std::span<const Run> others = {});

}  // namespace emtb
