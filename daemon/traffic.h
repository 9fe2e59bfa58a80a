#pragma once

#include <span>

#include "hal/input_device.h"

namespace emtb {

/// [1/s] readings of a channel; one that names no period is read at each tick. @param loop_rate [Hz]
inline double readings_per_second(const Channel& channel, double loop_rate) noexcept {
  return channel.period > 0 ? 1 / channel.period : loop_rate;
}

/// [1/s] of all channels, and of u_ref, which comes at each tick.
inline double readings_per_second(std::span<const Channel> channels, double loop_rate) noexcept {
  double sum = loop_rate;
  for (const Channel& channel : channels) sum += readings_per_second(channel, loop_rate);
  return sum;
}

}  // namespace emtb
