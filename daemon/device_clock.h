#pragma once

#include <string>
#include <vector>

#include "hal/bench.h"

namespace emtb {

/// The clock of a device that takes its samples by one of its own.
struct DeviceClock {
  std::vector<Signal> signals;  ///< that the device measures
  ClockEstimate estimate;
};

/// One for each device that has a clock.
std::vector<DeviceClock> device_clocks(const Bench& bench);

/// `e_a, omega: their clock is fast by 39.8 ppm (+-0.5, over 60 s), 2.4 ms by now`.
std::string describe(const DeviceClock& clock);

}  // namespace emtb
