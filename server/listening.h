#pragma once

#include <sys/types.h>

#include <filesystem>

namespace emtb {

/// A Unix socket that listens at a path (mode 0660, group emtb where there is one); the file of a dead daemon is
/// replaced.
class Listening {
 public:
  /// @throws ProtocolError where a living daemon answers there, or the path cannot be had.
  explicit Listening(const std::filesystem::path& path);
  ~Listening();  ///< removes the file, where it is still this one: not that of a daemon which took the path since
  Listening(const Listening&) = delete;
  Listening& operator=(const Listening&) = delete;

  int descriptor() const noexcept { return socket_; }

 private:
  std::filesystem::path path_;
  int socket_ = -1;
  dev_t device_{};
  ino_t inode_{};
};

}  // namespace emtb
