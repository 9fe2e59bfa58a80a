#pragma once

#include <filesystem>
#include <string>

#include "config/yaml.h"
#include "experiment/conditions.h"

namespace emtb {

/// Reads a profile: `config/profiles/NAME.yaml`.
///
///     name: step_high
///     kind: step            # or ramp, staircase, random_steps, knots, coast_down, reversal, chirp, heat_soak,
///     from_csv level: 6              # [V] before: 1             # [s] at rest (0 V, or `rest`) before and after hold:
///     12 after: 12
/// @throws ConfigError with file, line and key.
Profile read_profile(const std::filesystem::path& path);
Profile read_profile(const YamlMap& yaml);

/// The same with what surrounds it on a bench. Both may be left out:
///
///     needs: {at_rest: true, field: true, idle: 20, temperature: 30}          # idle [min], temperature [degC]
///     pauses: [{at: 1, say: set the brake to 0.2 N m, within: 120}]           # [s] of the profile; within [s]
/// @throws ConfigError with file, line and key.
Experiment read_experiment(const std::filesystem::path& path);
Experiment read_experiment(const YamlMap& yaml);

/// A profile's file as a text that needs no other file: of kind `knots`, with its needs and pauses.
std::string self_contained(const YamlMap& yaml);

/// Any profile as a file of kind `knots`, point by point.
std::string to_yaml(const Profile& profile);

}  // namespace emtb
