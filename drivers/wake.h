#pragma once

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cmath>
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
  /// Waits so long, or until the wish.
  void rest(double seconds) const noexcept {
    pollfd wish{.fd = file_, .events = POLLIN, .revents = 0};
    if (seconds > 0) poll(&wish, 1, static_cast<int>(std::ceil(seconds * 1e3)));
  }
  int descriptor() const noexcept { return file_; }  ///< readable from the wish on

 private:
  int file_;
  std::atomic<bool> wished_ = false;
};

}  // namespace emtb
