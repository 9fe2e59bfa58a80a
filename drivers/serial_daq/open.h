#pragma once

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/serial_daq/board.h"

namespace emtb::serial_daq {

/// The settings of a `serial_daq`: port, line, rate, start_up, counts, gear, bus, and channels: {SIGNAL: {from, scale,
/// offset}}; of `reference`, where it drives that, the limits and full_duty. @throws ConfigError with file, line and
/// key
BoardSettings read_settings(const YamlMap& device, const BenchConfig::Reference* reference);

/// `serial_daq`: a microcontroller that speaks docs/serial-daq-protocol.md. Input, and output of the reference by PWM.
OpenedDevice open_board(const OpenRequest& request);
void check_board(const OpenRequest& request);

}  // namespace emtb::serial_daq
