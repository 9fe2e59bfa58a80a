#pragma once

#include <span>
#include <vector>

#include "model/model.h"
#include "model/simulation.h"

namespace emtb {

/// [V] What the driver of a model makes of the reference, at each time of the excitation.
std::vector<double> driver_voltage(const Model& model, std::span<const double> values, const Excitation& x);

}  // namespace emtb
