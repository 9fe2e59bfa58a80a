#pragma once

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>
#include <filesystem>
#include <string>
#include <string_view>

namespace emtb {

/// A client without manners.
class RawClient {
 public:
  RawClient() : socket_(::socket(AF_UNIX, SOCK_STREAM, 0)) {}
  explicit RawClient(const std::filesystem::path& path) : RawClient() { connect(path); }
  ~RawClient() { close(socket_); }
  RawClient(const RawClient&) = delete;
  RawClient& operator=(const RawClient&) = delete;
  void connect(const std::filesystem::path& path) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    connected = ::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
  }
  bool send(std::string_view text) const {
    while (!text.empty()) {
      const ssize_t n = ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL);
      if (n <= 0) return false;
      text.remove_prefix(static_cast<std::size_t>(n));
    }
    return true;
  }
  /// Never waits: what the other end does not take is not sent.
  void send_what_fits(std::string_view text) const {
    ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  /// One line; empty where none comes, or the connection has ended.
  std::string line(double seconds = 30) {
    while (input_.find('\n') == std::string::npos) {
      pollfd readable{.fd = socket_, .events = POLLIN, .revents = 0};
      if (poll(&readable, 1, static_cast<int>(seconds * 1e3)) <= 0) return "";
      char chunk[4096];
      const ssize_t n = recv(socket_, chunk, sizeof chunk, 0);
      if (n <= 0) {
        ended = true;
        return "";
      }
      input_.append(chunk, static_cast<std::size_t>(n));
    }
    std::string text = input_.substr(0, input_.find('\n'));
    input_.erase(0, text.size() + 1);
    return text;
  }
  bool connected = false;
  bool ended = false;

 private:
  int socket_;
  std::string input_;
};

}  // namespace emtb
