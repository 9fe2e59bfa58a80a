#pragma once

#include <functional>
#include <optional>

#include "analysis/diagnose/search.h"
#include "analysis/record/dataset.h"

namespace emtb {

/// Does a measured torque load the shaft in some run? It acts on the motion as it was read, whatever its law, so that
/// what a model says of the load is told by the gauge alone.
bool torque_loads_the_shaft(const Dataset& data);

/// Effects of the load, and of the gauge that reads it.
bool concerns_the_load(const EffectInfo& effect);

/// The law of a measured torque, asked by itself: a search among the effects of the load and of its gauge. None where
/// what is found leaves more than a tenth of how much the torque varies: then the torque is an input, and its reading
/// no error of the model.
/// @param search a search that begins with a trial
std::optional<Finding> law_of_the_load(const Trial& fitted, const std::function<Finding(const Trial&)>& search);

/// A fitted model whose search leaves the load alone.
Trial without_effects_of_the_load(Trial fitted);

/// What a search found on top of a law of the load, and that law, as one.
Finding with_law(Finding law, Finding found);

/// Takes the readings of a signal out of what a model is compared with; what it drives it still drives.
void leave_out(Dataset& data, Signal signal);

}  // namespace emtb
