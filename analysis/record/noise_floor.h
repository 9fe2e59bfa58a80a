#pragma once

#include <map>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/record/record.h"
#include "hal/signal.h"

namespace emtb {

/// The error, in multiples of the noise floor, from which something is off: what the floor itself may be wrong by.
/// By hand: a tenth covers the floors of the blind benches but for the slow meters (docs/blind.md).
inline constexpr double above_the_floor = 1.1;

/// Of how much a signal varies: no simulation whose steps are a tenth of the time constant is better.
inline constexpr double accuracy_of_a_simulation = 2e-4;

/// What tells a noise floor.
enum class FloorSource { declared, counts, settled, repeats, regression, differences, resolution, accuracy, assumed };
std::string_view name_of(FloorSource source) noexcept;  ///< as in JSON

/// The noise of one signal: what even a perfect model would leave.
struct NoiseFloor {
  double sigma = 0;  ///< SI
  FloorSource from = FloorSource::differences;
  bool lower_bound = false;    ///< true: taken from differences, which coloured noise makes 3-4 times too small
  bool upper_bound = false;    ///< true: the readings are so far apart that they move more than they scatter
  double relative_error = 0;   ///< of sigma: how well it is known; 0: as good as exactly
  double autocorrelation = 0;  ///< from one reading to the next, in settled stretches
};

using Noise = std::map<Signal, NoiseFloor>;

/// The noise floor of each signal, the first that applies: declared in the model; for what is made of an encoder's
/// counts, what whole counts leave (count_errors.h); scatter about a straight line in stretches of settled readings of
/// 1 s or more, of a speed made of counts while it turns, pooled over all records; scatter of repeated runs about
/// each other; differences. For a slow meter, scatter about a line through the fast signals beside it, where that is
/// clearly less: what settles within a few readings may still relax. Never below LSB/sqrt(12). Settled stretches come
/// before repeats, which also differ by what an effect adds to each anew: a ripple whose angle nobody set. Never below
/// 2e-4 of how much the signal varies: a simulation's steps are no better than that.
Noise estimate_noise(std::span<const ObservedRun> records, const Model& model);

}  // namespace emtb
