#pragma once

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstdint>
#include <system_error>

namespace emtb {

/// Wakes a device's thread, as often as need be. Ringing never blocks, so the loop may.
class Doorbell {
 public:
  /// @throws std::system_error where the process has no descriptor left
  Doorbell() : file_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {
    if (file_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  }
  ~Doorbell() { close(file_); }
  Doorbell(const Doorbell&) = delete;
  Doorbell& operator=(const Doorbell&) = delete;

  void ring() const noexcept {
    const std::uint64_t one = 1;
    [[maybe_unused]] const ssize_t sent = write(file_, &one, sizeof one);  // fails only where it rings already
  }
  /// Returns once it rings, or has rung; or after so many seconds. @return whether it rings
  bool listen(double seconds) const noexcept {
    pollfd bell{.fd = file_, .events = POLLIN, .revents = 0};
    return poll(&bell, 1, static_cast<int>(std::ceil(std::max(seconds, 0.0) * 1e3))) > 0;
  }
  /// The same, and then it rings no longer.
  void wait(double seconds) const noexcept {
    if (listen(seconds)) answer();
  }
  /// It rings no longer.
  void answer() const noexcept {
    std::uint64_t rung = 0;
    [[maybe_unused]] const ssize_t got = read(file_, &rung, sizeof rung);
  }
  int descriptor() const noexcept { return file_; }  ///< readable while it rings

 private:
  int file_;
};

}  // namespace emtb
