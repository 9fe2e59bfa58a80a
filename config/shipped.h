#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace emtb {

/// Where the files that come with emtb may be, first things first: beside the program where it is installed
/// (`../share/emtb`), else where its source lies.
std::vector<std::filesystem::path> shipped_folders();

/// A file that comes with emtb, by its place in config/: `benches/fh2-simulated.yaml`.
/// @throws ConfigError naming where it looked.
std::filesystem::path shipped(const std::filesystem::path& file);

/// A file that a bench names as it is seen from the bench's folder: `../models/fh2.yaml`. Where it is not there, since
/// a bench of ours was copied elsewhere (/etc/emtb/bench.yaml for one), the one of that name that comes with emtb.
/// @param kind its folder in config/: `models`
/// @return its path, which need not be there
std::filesystem::path beside_or_shipped(const std::filesystem::path& folder, const std::filesystem::path& named,
                                        const std::string& kind);

}  // namespace emtb
