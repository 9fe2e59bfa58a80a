#pragma once

#include <span>

#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// Does a measured voltage that is the model's input hop from reading to reading while the current does not follow?
/// Then it is its instrument that is noisy, not the motor's voltage, and a model that is driven by it shows that noise
/// in each current that it predicts. False where the current follows, where nothing tells it, and of a voltage that was
/// set.
///
/// Where the voltage has edges or corners, a current follows hops by as much as it follows those. Without by one over
/// the resistance at least: the largest that the largest current under the largest voltage, and a back-EMF as large,
/// leave.
/// @param runs of one file or set, logged alike
bool voltage_hops_alone(std::span<const Run> runs, const Model& model);

}  // namespace emtb
