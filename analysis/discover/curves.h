#pragma once

#include <vector>

#include "analysis/discover/grammar.h"

namespace emtb {

/// Laws that are no short formula but a curve: for what none of the grammar's sentences follows.
///
/// Over speed, current and reference a curve is its own values at even distances, straight between them and of the sign
/// that opposes the motion; over the angle it is the first few waves of a turn. A straight line through zero is a base
/// parameter's (viscous friction, torque constant, armature resistance, back-EMF constant), so that the curve is told
/// from zero at the far end of what the data span. Each stands with and without a value at zero: what opposes all
/// motion alike is Coulomb friction's, where a model has it. Only as many values as the samples reach.
std::vector<FormulaText> curves(const Samples& samples, double torque_scale, double voltage_scale, bool voltage);

/// Curves over the speed that follow within a time: with their value at the far end, too, since a line that lags is no
/// base parameter's. None without paths, none of a voltage.
std::vector<FormulaText> remembering_curves(const Samples& samples, double torque_scale, double voltage_scale,
                                            bool voltage);

}  // namespace emtb
