#pragma once

#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <system_error>

namespace emtb {

/// Asks a device's thread to end, and wakes it wherever it waits.
class Wake {
 public:
  /// @throws std::system_error where the process has no descriptor left
  Wake() : file_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (file_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~Wake() { close(file_); }
  Wake(const Wake&) = delete;
  Wake& operator=(const Wake&) = delete;

  void wish() noexcept {
    wished_ = true;
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t sent = write(file_, &one, sizeof one);  // fails only where it is readable already
  }
  bool wished() const noexcept { return wished_; }
  int descriptor() const noexcept { return file_; }  ///< readable from the wish on

 private:
  int file_;
  std::atomic<bool> wished_ = false;
};

}  // namespace emtb
