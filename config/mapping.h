#pragma once

#include <filesystem>

#include "config/yaml.h"
#include "session/mapping.h"

namespace emtb {

/// Reads `--map FILE`. @throws ConfigError with file, line and key.
Mapping read_mapping(const std::filesystem::path& path);
Mapping read_mapping(const YamlMap& yaml);

}  // namespace emtb
