#pragma once

#include <filesystem>

#include "config/yaml.h"
#include "experiment/profile.h"

namespace emtb {

/// Reads a profile: `config/profiles/NAME.yaml`.
///
///     name: step_high
///     kind: step            # step, ramp, staircase, random_steps
///     level: 6              # [V]
///     before: 1             # [s] at rest (0 V, or `rest`) before and after
///     hold: 12
///     after: 12
/// @throws ConfigError with file, line and key.
Profile read_profile(const std::filesystem::path& path);
Profile read_profile(const YamlMap& yaml);

}  // namespace emtb
