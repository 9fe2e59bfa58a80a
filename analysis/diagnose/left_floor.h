#pragma once

#include <optional>

#include "analysis/record/dataset.h"
#include "model/model.h"

namespace emtb {

/// A floor is what even a perfect model would leave, so that none is higher than what some model leaves. Stretches that
/// seemed settled may hold what a controller makes of its own noise; readings that are far apart move more than they
/// scatter. Floors that were guessed and of which a fitted model leaves less than half the power are taken down to what
/// it leaves, of the readings that are as sure as the floor itself. None where all stay.
std::optional<Noise> floors_down_to_what_is_left(const Dataset& data, const Model& fitted);

}  // namespace emtb
