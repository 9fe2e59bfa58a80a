#pragma once

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/serial_meter/meter.h"

namespace emtb::serial_meter {

/// The settings of a `serial_meter`: port, model, signal, function, scale, offset, range, resolution, period, window,
/// latency, timeout, line, dtr, rts. @throws ConfigError with file, line and key.
MeterSettings read_settings(const YamlMap& device);

/// `line`, `dtr` and `rts`, over what is usual.
LineSettings read_line_settings(const YamlMap& device, const LineSettings& usual);

/// `serial_meter`: a multimeter on a serial line, one of models(). Input only.
OpenedDevice open_meter(const OpenRequest& request);

}  // namespace emtb::serial_meter
