#pragma once

#include "analysis/record/noise_floor.h"
#include "analysis/record/record.h"

namespace emtb {

/// The last step from a run to a record: how far the simulation trusts a measured angle, and for each reading its
/// sigma, the floor, widened where timing (a part of a sample on a slope of e_a) or the noise of the measured input
/// limit what any model could predict. Uses the model's start values only, so that it stays the same for all models
/// that are compared.
/// @param noise of all signals observed
Record weighed(ObservedRun run, const Noise& noise, const Model& model);

}  // namespace emtb
