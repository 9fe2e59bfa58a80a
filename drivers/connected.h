#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace emtb {

/// Something at this machine that a bench file could name.
struct ConnectedDevice {
  std::string what;   ///< for a person: `USB-1608GX-2AO`
  std::string entry;  ///< to write in the bench file: `driver: usb1608g, serial: 01A2B3C4`
};

/// DAQ cards on the USB, then serial ports: by their lasting names where they have one. Opens no port.
/// @param dev where device files lie
/// @throws DeviceError where the USB cannot be looked at
std::vector<ConnectedDevice> connected_devices(const std::filesystem::path& dev = "/dev");

}  // namespace emtb
