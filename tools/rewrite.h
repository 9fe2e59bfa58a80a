#pragma once

#include <filesystem>
#include <string>

namespace emtb {

/// Puts another text into a file, all at once; its mode stays. @throws Error where it cannot be written
void rewrite(const std::filesystem::path& file, const std::string& text);

}  // namespace emtb
