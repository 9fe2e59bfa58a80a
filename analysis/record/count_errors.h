#pragma once

#include <cstddef>

#include "analysis/record/angle_noise.h"
#include "analysis/record/observation.h"

namespace emtb {

/// The covariance of the errors of two counts of an encoder, in units of its step squared.
///
/// A count is the angle without what is left of the last step, so that its error is a sawtooth of the angle, and those
/// of two counts are two points of it, as many steps apart as the shaft turned between them:
///
///     cov(e_j, e_k) = q^2 (1/12 - f (1 - f)/2),  f = frac(steps between them)
///
/// Here f (1 - f) is averaged over a range of steps, for the speed is not known better than that.
/// @param fewest,most steps between the two; `most` not less than `fewest`
double count_covariance(double fewest, double most);

/// What whole counts leave in speeds that are slopes of lines through an encoder's angles: the variance of each, from
/// its own weights and the speed around it, and the correlation of neighbours. Below one count in a window the speed
/// may be anything up to that, whatever the counts say.
/// @param half of the samples in a line @param o its `lsb` is the encoder's step [rad]
/// @param noise of each angle besides
void count_errors_of_slopes(Observation& o, const Series& theta, std::size_t half, const AngleNoise& noise = {});

/// The same of differences of two counts: q^2 f (1 - f).
void count_errors_of_increments(Observation& o, const AngleNoise& noise = {});

}  // namespace emtb
