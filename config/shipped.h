#pragma once

#include <filesystem>
#include <vector>

namespace emtb {

/// Where the files that come with emtb may be, first things first: beside the program where it is installed
/// (`../share/emtb`), else where its source lies.
std::vector<std::filesystem::path> shipped_folders();

/// A file that comes with emtb, by its place in config/: `benches/fh2-simulated.yaml`.
/// @throws ConfigError naming where it looked.
std::filesystem::path shipped(const std::filesystem::path& file);

}  // namespace emtb
