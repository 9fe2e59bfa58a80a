#include "drivers/connected.h"

#include <algorithm>
#include <set>

#include "drivers/usb1608g/link.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code absent;
  for (fs::directory_iterator at(folder, absent), end; !absent && at != end; at.increment(absent)) {
    files.push_back(at->path());
  }
  std::ranges::sort(files);
  return files;
}

ConnectedDevice serial_port(const fs::path& path) {
  const std::string name = path.string();
  const bool board = name.find("Arduino") != std::string::npos || name.find("ttyACM") != std::string::npos;
  return {.what = board ? "microcontroller board?" : "serial port",
          .entry = (board ? "driver: serial_daq, port: " : "driver: serial_meter (or modbus_meter), port: ") + name};
}

}  // namespace

std::vector<ConnectedDevice> connected_devices(const fs::path& dev) {
  std::vector<ConnectedDevice> devices;
  for (const usb1608g::Connected& card : usb1608g::connected_cards()) {
    devices.push_back({.what = std::string(card.model->name),
                       .entry = card.serial.empty() ? "not ours to open: see systemd/60-emtb.rules"
                                                    : "driver: usb1608g, serial: " + card.serial});
  }
  std::set<fs::path> named;
  for (const fs::path& link : files_in(dev / "serial/by-id")) {
    std::error_code gone;
    named.insert(fs::canonical(link, gone));
    devices.push_back(serial_port(link));
  }
  for (const fs::path& port : files_in(dev)) {
    const std::string name = port.filename().string();
    const bool pluggable = name.starts_with("ttyUSB") || name.starts_with("ttyACM");
    std::error_code gone;
    if (pluggable && !named.contains(fs::canonical(port, gone))) devices.push_back(serial_port(port));
  }
  return devices;
}

}  // namespace emtb
