#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "config/bench.h"
#include "hal/bench.h"

namespace emtb {

/// Opens every device that a bench file names, each by the driver of that name.
/// @throws ConfigError for an unknown driver or setting, DeviceError where a device does not answer.
Bench open_bench(const BenchConfig& config);

/// What the simulation and each device find wrong with their settings: one line each, of the first thing that is. No
/// device is opened.
std::vector<std::string> complaints_of(const BenchConfig& config);

/// What measures, without what drives.
struct BenchInputs {
  struct Device {
    std::string name;
    std::unique_ptr<InputDevice> input;  ///< nothing where the device measures nothing, or does not open
    std::string why_not;                 ///< it does not open
    /// Of a simulated device: its machine is held where a signal has a value. Nothing: a person must.
    std::function<void(Signal, double)> hold{};
  };
  std::shared_ptr<Clock> clock;
  std::vector<Device> devices;
};

/// Opens every device to look at its signals. No output is opened; where a device has its output and its inputs on one
/// line, it is made safe. A device that does not answer does not stand in the way of the others.
/// @throws ConfigError for an unknown driver or setting
BenchInputs open_inputs(const BenchConfig& config);

/// The reference alone, to make it safe: nothing else is opened that the driver can do without, so that a broken input
/// or a program that holds it does not stand in the way. @throws as open_bench()
Bench open_reference(const BenchConfig& config);

}  // namespace emtb
