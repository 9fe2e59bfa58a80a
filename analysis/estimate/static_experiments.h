#pragma once

#include <span>
#include <vector>

#include "analysis/estimate/settled.h"
#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// Evaluates the experiments named, each by all its methods. One that lacks data says so and gives no numbers. Inverse
/// dynamics are none of them: they need a model's K_m (inverse_dynamics.h).
///
/// Where one needs what another finds, it is taken from `known` (unless that is a guess), else from these runs: K_m
/// from K_b (they are one in SI units; by the armature's equation, else the generator test), T_c from the friction
/// inside the motor.
std::vector<StaticEstimate> evaluate(std::span<const StaticExperiment> experiments, std::span<const Run> runs,
                                     const Settled& settled, KnownParameters known = {});

/// Runs that have an angle and no speed get the speed from it: slopes of lines through 40 ms.
std::vector<Run> with_speed(std::vector<Run> runs);

}  // namespace emtb
