#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace emtb {

/// A file, whole. Regular files only, of at most `longest` bytes: whoever opens a pipe may wait for good, and a device
/// may never end.
/// @param wanted what would be right, for the message: `the path of a .csv`
/// @throws Error that names the file and why it cannot be read
std::string read_regular_file(const std::filesystem::path& path, std::uint64_t longest, const std::string& wanted);

}  // namespace emtb
