#pragma once

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/usb1608g/input.h"
#include "drivers/usb1608g/output.h"

namespace emtb::usb1608g {

/// The settings of a `usb1608g`: serial, fpga, calibration, rate, latency, pacer, start_bytes, and channels: {SIGNAL:
/// {channel, wiring, range, scale, offset}}.
/// @param rate [Hz] of the loop: the scan's, where the file says nothing else
/// @throws ConfigError with file, line and key
InputSettings read_settings(const YamlMap& device, double rate);

/// What `reference` says of the output: channel, read_back, and limits that the card can give.
OutputSettings read_output(const BenchConfig::Reference& reference, const CardSettings& card);

/// `usb1608g`: MCC USB-1608G, -1608GX, -1608GX-2AO. Input, and with -2AO output of the reference.
OpenedDevice open_card(const OpenRequest& request);
void check_card(const OpenRequest& request);

}  // namespace emtb::usb1608g
