#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace emtb {

/// The SHA-256 of a file's bytes, as 64 hexadecimal digits. @throws Error where the file cannot be read.
std::string sha256(const std::filesystem::path& file);

/// The same of a text.
std::string sha256_of(std::string_view text);

}  // namespace emtb
