#pragma once

#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "config/yaml.h"
#include "drivers/comedi/input.h"
#include "drivers/comedi/output.h"
#include "drivers/driver.h"

namespace emtb::comedi {

/// The settings of a `comedi` card: device, board, calibration, rate, and channels: {SIGNAL: {channel, wiring, range,
/// scale, offset}}.
/// @param rate [Hz] of the loop: the scan's, where the file says nothing else
/// @throws ConfigError with file, line and key
InputSettings read_settings(const YamlMap& device, double rate);

/// What `reference` says of the output: channel, read_back.
OutputSettings read_output(const BenchConfig::Reference& reference, const CardSettings& card);

/// `comedi`: any PCI or USB card with a comedi driver that scans by its own clock. Input, and output of the reference.
OpenedDevice open_card(const OpenRequest& request);
void check_card(const OpenRequest& request);

/// The cards that the kernel's drivers have found: node (`/dev/comedi0`), and what the driver calls the card; empty
/// where it cannot be opened.
std::vector<std::pair<std::string, std::string>> connected_cards(const std::filesystem::path& dev);

}  // namespace emtb::comedi
