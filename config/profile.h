#pragma once

#include <filesystem>
#include <string>

#include "config/yaml.h"
#include "experiment/profile.h"

namespace emtb {

/// Reads a profile: `config/profiles/NAME.yaml`.
///
///     name: step_high
///     kind: step            # step, ramp, staircase, random_steps, knots
///     level: 6              # [V]
///     before: 1             # [s] at rest (0 V, or `rest`) before and after
///     hold: 12
///     after: 12
/// @throws ConfigError with file, line and key.
Profile read_profile(const std::filesystem::path& path);
Profile read_profile(const YamlMap& yaml);

/// Any profile as a file of kind `knots`, point by point.
std::string to_yaml(const Profile& profile);

}  // namespace emtb
