#pragma once

#include <span>
#include <vector>

namespace emtb {

/// The frequency at which series ring: where their common spectrum stands furthest out of its surroundings, an octave
/// to each side. Told to a tenth from two seconds of a decaying oscillation.
/// @param interval [s] between readings
/// @return [rad/s]; 0 where nothing stands out, or there are less than a hundred readings
double ringing_frequency(std::span<const std::vector<double>> series, double interval);

}  // namespace emtb
