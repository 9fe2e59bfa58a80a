#include "experiment/first_experiments.h"

#include <algorithm>

#include "hal/error.h"

namespace emtb {
namespace {

void demand_sensible(double low, double high, double settle) {
  if (!(low <= 0 && high > 0)) {
    throw ConfigError("experiments need a reference from 0 V or below to something above 0 V");
  }
  if (!(settle > 0)) throw ConfigError("the time in which the motor settles must be above 0 s");
}

/// Levels at random, such that no jump is larger than `high`.
Profile random_sequence(const std::string& name, double low, double high, double settle, std::uint64_t seed) {
  const bool reverses = low < 0;
  const double from = reverses ? std::max(low, -0.5 * high) : 0.1 * high;
  const double to = reverses ? from + high : high;
  return random_steps(name, from, to, 0.12 * settle, 0.5 * settle, 0.1 * settle, 4 * settle, 0.7 * settle, seed);
}

}  // namespace

Experiments first_experiments(double low, double high, double settle) {
  demand_sensible(low, high, settle);
  const bool reverses = low < 0;
  const double rest = 0.1 * settle, end = 0.8 * settle;
  std::vector<double> levels{0.2 * high, 0.5 * high, high, 0.7 * high, 0.3 * high};
  if (reverses) levels.insert(levels.end(), {0.2 * low, 0.8 * low, 0.4 * low});
  Experiments all;
  all.train = {step("step_low", 0.3 * high, rest, settle, end),
               step("step_high", reverses ? low : high, rest, settle, end),
               ramp("ramp", high, high / (1.2 * settle), rest, 0.3 * settle, 0.3 * settle),
               random_sequence("random", low, high, settle, 1)};
  all.held_out = {step("step_mid", 0.65 * high, rest, settle, end),
                  staircase("staircase", levels, rest, 0.5 * settle, end)};
  return all;
}

Profile confirming_experiment(double low, double high, double settle, std::uint64_t seed) {
  demand_sensible(low, high, settle);
  return random_sequence("confirm", low, high, settle, seed);
}

}  // namespace emtb
