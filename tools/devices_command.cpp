#include <algorithm>
#include <iostream>
#include <string>
#include <vector>

#include "drivers/connected.h"
#include "figures/terminal.h"
#include "hal/printable.h"
#include "report/text.h"
#include "tools/commands.h"

namespace emtb {
namespace {

/// What a device is and, beside it or where the line has no room below it, what to write in a bench file.
std::string table_of(const std::vector<ConnectedDevice>& devices, std::size_t width) {
  std::size_t column = 0, whole = 0;
  for (const ConnectedDevice& device : devices) column = std::max(column, device.what.size() + 2);
  for (const ConnectedDevice& device : devices) whole = std::max(whole, column + device.entry.size());
  std::string text;
  for (const auto& [what, entry] : devices) {
    text += printable(what) + (whole <= width ? std::string(column - what.size(), ' ') : "\n    ") + printable(entry) +
            "\n";
  }
  return text;
}

}  // namespace

void add_devices_command(CommandLine& line) {
  line.command("devices", "lists what is connected, and what to write of it in a bench file").action([] {
    const std::vector<ConnectedDevice> devices = connected_devices();
    if (devices.empty()) {
      std::cout << fitted("nothing is connected that emtb knows: no USB-1608G, no comedi card, no USB serial port",
                          width_of_prose());
      return 1;
    }
    std::cout << table_of(devices, width_of_rows());
    return 0;
  });
}

}  // namespace emtb
