#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

namespace emtb {

/// The far end of a serial line: what is written here arrives at the port that path() names, and the other way round.
class PseudoTerminal {
 public:
  PseudoTerminal() {
    std::array<char, 256> name{};
    termios raw{};
    cfmakeraw(&raw);
    if (openpty(&near_, &far_, name.data(), &raw, nullptr) != 0) throw std::runtime_error("openpty");
    for (const int end : {near_, far_}) fcntl(end, F_SETFD, FD_CLOEXEC);  // or a child would hold the line
    fcntl(near_, F_SETFL, O_NONBLOCK);                                    // what nobody reads is lost, as on a wire
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

/// An adapter's name under /dev/serial/by-id: stays, whatever port it stands for.
class PortName {
 public:
  PortName() : path_(std::filesystem::path(::testing::TempDir()) / ("emtb_port_" + std::to_string(getpid()))) {}
  ~PortName() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  PortName(const PortName&) = delete;
  PortName& operator=(const PortName&) = delete;

  void stand_for(const std::string& port) const {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
    std::filesystem::create_symlink(port, path_);
  }
  std::string path() const { return path_.string(); }

 private:
  std::filesystem::path path_;
};

/// A meter at the other end, in a thread: `turn` is called again and again until the test ends.
class AtTheOtherEnd {
 public:
  explicit AtTheOtherEnd(std::function<void()> turn)
      : turn_(std::move(turn)), thread_([this] {
          while (!quit_) turn_();
        }) {}
  ~AtTheOtherEnd() { leave(); }
  AtTheOtherEnd(const AtTheOtherEnd&) = delete;
  AtTheOtherEnd& operator=(const AtTheOtherEnd&) = delete;
  void leave() {
    quit_ = true;
    if (thread_.joinable()) thread_.join();
  }

 private:
  std::function<void()> turn_;
  std::atomic<bool> quit_ = false;
  std::thread thread_;
};

}  // namespace emtb
