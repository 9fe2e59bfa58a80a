#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace emtb {

/// What a file was when somebody looked: enough to tell whether it still is that file, mostly without reading it.
struct FileState {
  std::string path;  ///< absolute
  std::uint64_t bytes = 0, inode = 0;
  std::int64_t written = 0, changed = 0;  ///< [ns] the file system's times: of the bytes, and of anything
  bool settled = false;                   ///< looked at so long after `changed` that a later change has another time
};

/// @return nothing for what is no regular file
std::optional<FileState> look_at(const std::filesystem::path& path);

/// Whether neither its times nor its place have moved.
bool seems_the_same(const FileState& before, const FileState& now);

/// Whether it has the same bytes for sure.
bool is_untouched(const FileState& before, const FileState& now);

}  // namespace emtb
