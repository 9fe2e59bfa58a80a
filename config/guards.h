#pragma once

#include <span>
#include <string>
#include <vector>

#include "config/bench.h"
#include "hal/input_device.h"

namespace emtb {

/// One limit of a bench file, and what sees that it is kept.
struct Guard {
  std::string key;    ///< `omega`
  std::string text;   ///< `limits.omega, 190 rad/s: daq channel 3, which reads -200 to 200 rad/s, says so within 2 ms`
  std::string wrong;  ///< why it guards nothing, and the line to write; empty: it does
};

/// What guards what, and how fast. @param channels of all devices
std::vector<Guard> guards_of(const BenchConfig& bench, std::span<const Channel> channels);

/// A limit that guards nothing is worse than none: somebody relies on it.
/// @throws ConfigError with file, line and the line to write: a limit whose signal nothing measures, whose channel
/// cannot read beyond it or does not say how far it reads; a `safe` that is not the allowed value nearest 0 V, without
/// `safe_because`
void refuse_what_guards_nothing(const BenchConfig& bench, std::span<const Channel> channels);

/// Where `safe` is not the value nearest 0 V: why, as the bench file says; empty: it is.
std::string why_not_zero(const BenchConfig& bench);

}  // namespace emtb
