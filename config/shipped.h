#pragma once

#include <filesystem>

namespace emtb {

/// A file that comes with emtb, by its place in config/: `benches/fh2-simulated.yaml`.
/// @throws ConfigError naming where it looked.
std::filesystem::path shipped(const std::filesystem::path& file);

}  // namespace emtb
