#pragma once

#include <filesystem>
#include <string>

namespace emtb {

/// The file of a profile: a path as it is, or a name (`step_high`) looked for in `profiles/` beside the bench file,
/// beside its folder, and among those that come with emtb.
/// @param bench the bench file; empty: only those that come with emtb
/// @throws ConfigError naming where it looked.
std::filesystem::path profile_path(const std::string& profile, const std::filesystem::path& bench = {});

/// The same of a name alone: what somebody else asks for must not make us open a path of his choice.
/// @throws ConfigError where it is not there, or more than a name: letters, digits, _ and -
std::filesystem::path named_profile(const std::string& name, const std::filesystem::path& bench);

/// Whether this can be the name of a profile: letters, digits, _ and -. It becomes part of its sessions' file names.
bool is_profile_name(const std::string& name);

}  // namespace emtb
