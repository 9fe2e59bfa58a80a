#pragma once

#include <filesystem>
#include <string>

namespace emtb {

/// Holds a file or folder for this process alone (flock); gone with the process, however it dies, and leaves nothing
/// behind.
class PathLock {
 public:
  /// @param what for the message: `bench`
  /// @throws Error where another process holds it, or it cannot be opened.
  PathLock(const std::filesystem::path& path, const std::string& what);
  ~PathLock();
  PathLock(const PathLock&) = delete;
  PathLock& operator=(const PathLock&) = delete;

 private:
  int file_ = -1;
};

}  // namespace emtb
