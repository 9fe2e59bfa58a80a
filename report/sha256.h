#pragma once

#include <filesystem>
#include <string>

namespace emtb {

/// The SHA-256 of a file's bytes, as 64 hexadecimal digits. @throws Error where the file cannot be read.
std::string sha256(const std::filesystem::path& file);

}  // namespace emtb
