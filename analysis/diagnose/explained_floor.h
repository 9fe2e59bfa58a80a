#pragma once

#include <optional>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/record/noise_floor.h"

namespace emtb {

/// Noise has no law. A floor was read off stretches in which nothing seems to change, and what repeats with the angle,
/// say, counts as noise there where the shaft does not turn far enough to tell. Where an effect that the model lacks
/// foretells three quarters of what is left of a signal, in runs that its fit never saw, it is a part of that floor:
/// the floors without it. None where all stay.
/// @param fitted a model that leaves no more than its floors
std::optional<Noise> floors_without_a_law(FittedTrials& trials, const Noise& noise, const Trial& fitted);

}  // namespace emtb
