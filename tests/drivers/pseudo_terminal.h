#pragma once

#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>

namespace emtb {

/// The far end of a serial line: what is written here arrives at the port that path() names, and the other way round.
class PseudoTerminal {
 public:
  PseudoTerminal() {
    std::array<char, 256> name{};
    termios raw{};
    cfmakeraw(&raw);
    if (openpty(&near_, &far_, name.data(), &raw, nullptr) != 0) throw std::runtime_error("openpty");
    path_ = name.data();
  }
  ~PseudoTerminal() { hang_up(); }
  PseudoTerminal(const PseudoTerminal&) = delete;
  PseudoTerminal& operator=(const PseudoTerminal&) = delete;

  const std::string& path() const noexcept { return path_; }

  void write(std::string_view bytes) const {
    while (!bytes.empty()) {
      const ssize_t sent = ::write(near_, bytes.data(), bytes.size());
      if (sent <= 0) return;
      bytes.remove_prefix(static_cast<std::size_t>(sent));
    }
  }
  /// What has come, or comes within `seconds`.
  std::string read(double seconds) const {
    pollfd ready{.fd = near_, .events = POLLIN, .revents = 0};
    if (::poll(&ready, 1, static_cast<int>(seconds * 1e3)) <= 0) return {};
    std::array<char, 256> buffer{};
    const ssize_t got = ::read(near_, buffer.data(), buffer.size());
    return {buffer.data(), got > 0 ? static_cast<std::size_t>(got) : 0};
  }
  /// As if the adapter were pulled.
  void hang_up() {
    for (int* end : {&near_, &far_}) {
      if (*end >= 0) ::close(*end);
      *end = -1;
    }
  }

 private:
  int near_ = -1;
  int far_ = -1;  ///< kept open: a port that nobody has opened yet has not gone
  std::string path_;
};

}  // namespace emtb
