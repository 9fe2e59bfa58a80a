#pragma once

#include <filesystem>
#include <string>

namespace emtb {

/// Holds a file or folder for this process alone; given up with the process, however it dies.
///
/// What is locked (flock) is a file of our own in lock_folder(), which nobody else may open: a lock on the thing itself
/// could be taken, and kept, by whoever may read it.
class PathLock {
 public:
  /// @param what for the message: `bench`
  /// @throws Error where another process holds it, or it cannot be opened.
  PathLock(const std::filesystem::path& path, const std::string& what);
  ~PathLock();
  PathLock(const PathLock&) = delete;
  PathLock& operator=(const PathLock&) = delete;

 private:
  std::filesystem::path lock_;
  int file_ = -1;
};

/// Ours alone: in $XDG_RUNTIME_DIR, or in /run/emtb or /tmp, with our user's number in its name. Made where missing.
/// @throws Error where somebody else has made it
std::filesystem::path lock_folder();

}  // namespace emtb
