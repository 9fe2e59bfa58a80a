#pragma once

#include "config/bench.h"
#include "hal/bench.h"

namespace emtb {

/// Opens every device that a bench file names, each by the driver of that name.
/// @throws ConfigError for an unknown driver or setting, DeviceError where a device does not answer.
Bench open_bench(const BenchConfig& config);

}  // namespace emtb
