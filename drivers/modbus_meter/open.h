#pragma once

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/modbus_meter/meter.h"

namespace emtb::modbus_meter {

/// The settings of a `modbus_meter`: tcp or port (with line), unit, period, timeout, latency, and registers: {SIGNAL:
/// {address, function, type, order, scale, offset, unit, overload, window, resolution}}.
/// @throws ConfigError with file, line and key
MeterSettings read_settings(const YamlMap& device);

/// `modbus_meter`: anything that answers to Modbus RTU or TCP. Input only.
OpenedDevice open_meter(const OpenRequest& request);

}  // namespace emtb::modbus_meter
