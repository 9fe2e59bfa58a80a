#pragma once

#include <filesystem>

#include "session/mapping.h"

namespace emtb {

/// Reads `--map FILE`. @throws ConfigError with file, line and key.
Mapping read_mapping(const std::filesystem::path& path);

}  // namespace emtb
