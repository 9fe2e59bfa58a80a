#pragma once

#include <span>

#include "session/session.h"

namespace emtb {

/// How much the readings of an angle scatter beyond what whole steps of its instrument leave, standard deviation [rad].
/// 0 for an encoder, which is silent at rest. A potentiometer is not.
///
/// Told where the shaft rests: in pieces whose readings hop and yet range no further than such hops explain. Moving, an
/// angle scatters also because its times do.
/// @param runs,others that were logged alike; of one whose step is not known nothing is told
double angle_noise(std::span<const Run> runs, std::span<const Run> others = {});

}  // namespace emtb
