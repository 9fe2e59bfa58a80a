#pragma once

#include <array>
#include <span>
#include <string_view>
#include <vector>

#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// The experiments of sections 3 and 4 of Erdal et al. (2011), as `emtb estimate --what` calls them.
inline constexpr std::array<std::string_view, 7> static_experiments{
    "resistance", "generator", "friction", "torque-constant", "inertia", "coast-down", "driver"};

/// Evaluates the experiments named, each by all its methods. One that lacks data says so and gives no numbers.
///
/// Where one needs what another finds, it is taken from `known` (unless that is a guess), else from these runs: K_m
/// from K_b (they are one in SI units; by the armature's equation, else the generator test), T_c from the friction
/// inside the motor.
std::vector<StaticEstimate> evaluate(std::span<const std::string_view> what, std::span<const Run> runs,
                                     const Settled& settled, KnownParameters known = {});

/// Runs that have an angle and no speed get the speed from it: slopes of lines through 40 ms.
std::vector<Run> with_speed(std::vector<Run> runs);

}  // namespace emtb
