#pragma once

#include "config/bench.h"
#include "hal/bench.h"

namespace emtb {

/// Opens every device that a bench file names, each by the driver of that name.
/// @throws ConfigError for an unknown driver or setting, DeviceError where a device does not answer.
Bench open_bench(const BenchConfig& config);

/// The reference alone, to make it safe: nothing else is opened that the driver can do without, so that a broken input
/// or a program that holds it does not stand in the way. @throws as open_bench()
Bench open_reference(const BenchConfig& config);

}  // namespace emtb
