#pragma once

#include <filesystem>
#include <functional>

namespace emtb {

/// Replaces a file, or makes it, all at once: `write` fills a draft beside it, which is brought to the disk and then
/// takes its place. Whatever goes wrong, or whenever the process dies, the old file stands.
/// @throws SessionError, and what `write` throws
void replace_file(const std::filesystem::path& path,
                  const std::function<void(const std::filesystem::path& draft)>& write);

}  // namespace emtb
