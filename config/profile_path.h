#pragma once

#include <filesystem>
#include <string>

namespace emtb {

/// The file of a profile: a path as it is, or a name (`step_high`) looked for in `profiles/` beside the bench file,
/// beside its folder, and among those that come with emtb.
/// @param bench the bench file; empty: only those that come with emtb
/// @throws ConfigError naming where it looked.
std::filesystem::path profile_path(const std::string& profile, const std::filesystem::path& bench = {});

}  // namespace emtb
