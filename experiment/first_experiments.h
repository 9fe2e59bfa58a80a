#pragma once

#include <cstdint>
#include <vector>

#include "experiment/profile.h"

namespace emtb {

/// What a model should be fitted to, and judged on.
struct Experiments {
  std::vector<Profile> train, held_out;
};

/// What a careful person records of a motor that nothing is known of yet: a low and a high step, a slow ramp and a
/// random sequence to fit to; a step between and a staircase to judge by.
///
/// No jump is larger than `high`: a reversal from end to end would draw twice the current of a start.
/// @param low, high [V] of the reference; low < 0 where the driver can reverse
/// @param settle [s] in which the motor settles at a new reference, and a slow meter takes some readings there
/// @throws ConfigError where low is above 0, high is not above it, or settle is not positive.
Experiments first_experiments(double low, double high, double settle);

/// A run that none of those resembles, to try a prediction on: another seed, another sequence.
Profile confirming_experiment(double low, double high, double settle, std::uint64_t seed);

}  // namespace emtb
