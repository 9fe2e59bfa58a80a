#include <algorithm>
#include <iostream>

#include "drivers/connected.h"
#include "tools/commands.h"

namespace emtb {

void add_devices_command(CommandLine& line) {
  line.command("devices", "lists what is connected, and what to write of it in a bench file").action([] {
    const std::vector<ConnectedDevice> devices = connected_devices();
    if (devices.empty()) {
      std::cout << "nothing is connected that emtb knows: no USB-1608G, no USB serial port\n";
      return 1;
    }
    std::size_t width = 0;
    for (const ConnectedDevice& device : devices) width = std::max(width, device.what.size());
    for (const auto& [what, entry] : devices) {
      std::cout << what << std::string(width - what.size() + 2, ' ') << entry << "\n";
    }
    return 0;
  });
}

}  // namespace emtb
