#pragma once

#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "analysis/diagnose/search.h"
#include "analysis/record/dataset.h"

namespace emtb {

/// Effects of the load, and of the gauge that reads it.
bool concerns_the_load(const EffectInfo& effect);

/// Does a measured torque load the shaft, of which the model as given says nothing? It acts on the motion as it was
/// read, whatever its law: what a law says is told by the gauge alone, and what it leaves of the reading bends nothing.
bool torque_only_loads(std::span<const Record> records, const Model& given);

/// A fitted model of which a search may change nothing but what concerns the load.
/// @param given which effects were withheld from the beginning
Model with_only_the_load_open(Model fitted, const Model& given);

/// Does a law leave less than a fifth of what the torque has beyond its noise? Else the torque is an input, and its
/// reading no error of the model.
/// @param without no law: the torque is foretold to be nothing
bool follows_the_torque(const Loss& without, const Loss& with);
/// @param mean_square in squared floors, that it leaves of the torque
bool follows_the_torque(const Loss& without, double mean_square);

/// A law that was found with all else held fast, put on a model as given and fitted. The gauge alone may not tell a
/// weight from an offset of its own, the motion does: of what ties with a member, the likeliest is taken.
/// @param first the model as given, once fitted: what is free in it is free again
std::optional<Finding> put_on(const Finding& law, const Trial& first, Trials& trials, const Criterion& criterion);

/// A fitted model whose search leaves the load alone.
Trial without_effects_of_the_load(Trial fitted);

/// What a search found on top of a law of the load, and that law, as one.
Finding with_law(Finding law, Finding found);

/// Readings of some signals, of the training and of the held-out runs.
using Readings = std::vector<std::vector<Observation>>;

/// Takes the readings of some signals out of what a model is compared with; what they drive they still drive.
Readings leave_out(Dataset& data, const std::function<bool(Signal)>& these);

/// Puts them back.
void put_back(Dataset& data, Readings readings);

}  // namespace emtb
