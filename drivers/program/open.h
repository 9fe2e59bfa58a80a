#pragma once

#include "config/yaml.h"
#include "drivers/driver.h"
#include "drivers/program/device.h"

namespace emtb::program {

/// The settings of a `program`: command, user, start_up, silence, moves, and channels: {SIGNAL: {period, window,
/// latency, unit, scale, offset, resolution, range}}.
/// @param reference where it drives that: only with `moves: true` @throws ConfigError with file, line and key
ProgramSettings read_settings(const YamlMap& device, const BenchConfig::Reference* reference);

/// `program`: any program that speaks docs/wiring/program.md. Input, and, where it `moves`, output of the reference.
OpenedDevice open_program(const OpenRequest& request);
void check_program(const OpenRequest& request);

}  // namespace emtb::program
