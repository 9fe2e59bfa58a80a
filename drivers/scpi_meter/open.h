#pragma once

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/serial_meter/meter.h"

namespace emtb::scpi_meter {

/// The settings of a `scpi_meter`: port, line, dtr, rts, ending, setup, identity, query, parse, overload, mode, signal,
/// unit, scale, offset, resolution, range, period, window, latency, timeout. @throws ConfigError with file, line and
/// key.
serial_meter::MeterSettings read_settings(const YamlMap& device);

/// `scpi_meter`: any meter on a serial line that answers a question by a line with a number. Input only.
OpenedDevice open_meter(const OpenRequest& request);

}  // namespace emtb::scpi_meter
