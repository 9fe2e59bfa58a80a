#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "analysis/live/change.h"
#include "analysis/live/half_seconds.h"
#include "analysis/live/rest_readings.h"
#include "analysis/live/unknowns.h"

namespace emtb {

/// Effects that the model lacks and that would explain a material part of what it leaves, the best first.
/// @param all what is known by now. @param expected the unknowns of the model as it is, from `all`, and their
/// covariance
/// @param inflation of the standard errors
/// @param at_rest what an instrument would add was added there, too
std::vector<LiveSuspect> missing_effects(const WatchedUnknowns& unknowns, const HalfSeconds& rows,
                                         std::span<const NoiseColour> colours, const LiveEquations& all,
                                         const Eigen::VectorXd& expected, const Eigen::MatrixXd& covariance,
                                         const Eigen::VectorXd& inflation, const RestReadings& at_rest);

}  // namespace emtb
