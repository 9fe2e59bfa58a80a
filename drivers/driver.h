#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "config/bench.h"
#include "hal/analog_output.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb {

namespace simulated {
class World;
}

/// What a device turned out to be: an input, an output, or both.
struct OpenedDevice {
  std::unique_ptr<InputDevice> input;
  std::unique_ptr<AnalogOutput> output;
};

/// What a driver may look at to open a device.
struct OpenRequest {
  const BenchConfig& bench;
  const BenchConfig::Device& device;        ///< the entry to open; its keys are the driver's to check, with only()
  std::shared_ptr<Clock> clock;             ///< time stamps are on this one
  std::shared_ptr<simulated::World> world;  ///< the plant of a simulated bench, or nothing
  bool output_only = false;                 ///< to be made safe: whatever else the device has may be left alone
  bool input_only = false;                  ///< to be looked at: no output is opened, nothing moves

  /// The reference goes out through this device, and is wanted: then the driver opens the output and checks the keys of
  /// `reference`.
  bool drives_reference() const { return !input_only && bench.reference.device == device.name; }

  /// Refuses simulated time that runs at another pace than ours. @throws ConfigError
  void need_real_time() const {
    if (dynamic_cast<const MonotonicClock*>(clock.get()) != nullptr) return;
    device.yaml.fail("driver",
                     "is " + device.driver + ", a real device, whose time cannot be hurried. Let simulation.pace be 1");
  }

  /// Of a device that only measures. @throws ConfigError where the reference shall go out through it
  void need_no_output() const {
    if (drives_reference()) bench.reference.yaml.fail("device", "is `" + device.name + "`, which has no analog output");
  }
};

/// Opens a device that only measures, in real time. @param read_settings of the device's entry
template <class Device, class ReadSettings>
OpenedDevice open_input(const OpenRequest& request, ReadSettings read_settings) {
  request.need_real_time();
  OpenedDevice opened;
  opened.input = std::make_unique<Device>(request.device.name, request.clock, read_settings(request.device.yaml));
  return opened;
}

/// A kind of device, by the name under which bench files ask for it.
struct Driver {
  std::string_view name;
  /// @throws ConfigError for a setting that cannot be, DeviceError where the device does not answer
  OpenedDevice (*open)(const OpenRequest&);
  /// Reads all settings that open() would, and opens nothing. @throws ConfigError as open() does
  void (*check)(const OpenRequest&);
};

/// The check of a device that only measures. @tparam read_settings of the device's entry
template <auto read_settings>
void check_input(const OpenRequest& request) {
  request.need_real_time();
  request.need_no_output();
  read_settings(request.device.yaml);
}

}  // namespace emtb
