#include "server/client.h"

#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>
#include <thread>

#include "hal/format_version.h"
#include "server/stop_socket.h"

namespace emtb {
namespace {

using nlohmann::json;

constexpr double answer_within = 30;  // [s]; a reset may wait for a slow meter's next readings

/// No constant: what asks for memory before main() can tell nobody that there is none.
std::filesystem::path system_socket() { return "/run/emtb/emtb.sock"; }

std::filesystem::path users_socket() {
  const char* runtime = std::getenv("XDG_RUNTIME_DIR");
  if (runtime == nullptr || *runtime == '\0') return {};
  return std::filesystem::path(runtime) / "emtb.sock";
}

/// @return the descriptor; below 0 where nobody answers: errno
int connected(const std::filesystem::path& socket) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::string name = socket.string();
  if (name.size() >= sizeof address.sun_path) throw ProtocolError(name + ": too long for a socket's path");
  std::memcpy(address.sun_path, name.c_str(), name.size() + 1);
  const int made = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (made < 0 || connect(made, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return made;
  const int why = errno;
  close(made);
  errno = why;
  return -1;
}

/// Up to its first line's end, or as much as came; nothing where the time is over.
std::string line_of(int socket, double timeout) {
  timeval patience{.tv_sec = static_cast<time_t>(timeout), .tv_usec = 0};
  setsockopt(socket, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  std::string text;
  std::array<char, 256> chunk;
  while (text.find('\n') == std::string::npos) {
    const ssize_t n = recv(socket, chunk.data(), chunk.size(), 0);
    if (n < 0 && errno == EINTR) continue;  // a second Ctrl-C
    if (n <= 0) break;
    text.append(chunk.data(), static_cast<std::size_t>(n));
  }
  return text;
}

}  // namespace

Client::Client(const std::filesystem::path& socket) : path_(socket), socket_(connected(socket)) {
  if (socket_ >= 0) return;
  if (errno == EACCES) {
    throw ProtocolError(
        socket.string() +
        ": is not yours to use. Who is of the socket's group may: `sudo adduser $USER emtb`, then log in "
        "again");
  }
  throw ProtocolError(socket.string() + ": no daemon answers (" + std::strerror(errno) +
                      "). Start `emtbd --config BENCH.yaml`, or give its --socket");
}

Client::~Client() { close(socket_); }

void Client::send(const std::string& text) {
  for (std::size_t sent = 0; sent < text.size();) {
    const ssize_t n = ::send(socket_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw ProtocolError(path_.string() + ": the daemon is gone");
    sent += static_cast<std::size_t>(n);
  }
}

bool Client::fill(double timeout) {
  pollfd readable{.fd = socket_, .events = POLLIN, .revents = 0};
  if (poll(&readable, 1, static_cast<int>(std::ceil(timeout * 1e3))) <= 0) return false;
  std::array<char, 65536> chunk;
  const ssize_t n = recv(socket_, chunk.data(), chunk.size(), 0);
  if (n < 0 && errno == EINTR) return false;
  if (n <= 0) throw ProtocolError(path_.string() + ": the daemon is gone");
  input_.append(chunk.data(), static_cast<std::size_t>(n));
  return true;
}

std::optional<std::string> Client::line() {
  const auto end = input_.find('\n');
  if (end == std::string::npos) return std::nullopt;
  std::string text = input_.substr(0, end);
  input_.erase(0, end + 1);
  return text;
}

json Client::call(const std::string& method, const json& params) {
  if (!known_ && (method == "run" || method == "reset")) call("status", json::object());
  json result = ask(method, params);
  if (method == "status") {
    const int version = result.is_object() ? result.value("protocol", newest_format::protocol) : 0;
    if (version > newest_format::protocol)
      throw ProtocolError(path_.string() + ": the daemon there was " +
                          made_by_a_newer("protocol", version, newest_format::protocol));
    known_ = true;
  }
  return result;
}

json Client::ask(const std::string& method, const json& params) {
  const int id = ++id_;
  send(json{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params.is_null() ? json::object() : params}}
           .dump() +
       "\n");
  int patience = static_cast<int>(answer_within);
  while (true) {
    while (const auto text = line()) {
      const json answer = json::parse(*text, nullptr, false);
      if (!answer.is_object()) throw ProtocolError(path_.string() + ": what answers there is no emtb daemon");
      if (answer.contains("method")) {
        kept_ += *text + "\n";
        continue;
      }
      if (answer.contains("error") && answer["error"].is_object()) {
        const json& error = answer["error"];
        throw rpc::Refusal(error.value("code", 0), error.value("message", ""), error.value("data", json()));
      }
      if (answer.value("id", json()) == id && answer.contains("result")) return answer["result"];
      throw ProtocolError(path_.string() + ": what answers there is no emtb daemon");
    }
    if (!fill(1) && --patience <= 0) throw ProtocolError(path_.string() + ": the daemon does not answer");
  }
}

std::optional<json> Client::notification(double timeout) {
  input_ = kept_ + input_;
  kept_.clear();
  auto text = line();
  if (!text && fill(timeout)) text = line();
  if (!text) return std::nullopt;
  json message = json::parse(*text, nullptr, false);
  if (!message.is_object() || !message.contains("method")) return std::nullopt;
  return message;
}

Client daemon_at(const std::string& named) {
  constexpr std::chrono::milliseconds patience(1000), a_moment(20);
  const auto until = std::chrono::steady_clock::now() + patience;
  while (true) {
    try {
      return Client(socket_to_call(named));
    } catch (const ProtocolError&) {
      if (std::chrono::steady_clock::now() > until) throw;
    }
    std::this_thread::sleep_for(a_moment);
  }
}

json stop_now(const std::filesystem::path& socket) {
  const int stop = connected(stop_path(socket));  // to connect is to stop
  if (stop < 0 && (errno == ENOENT || errno == ECONNREFUSED)) return Client(socket).call("stop", json::object());
  if (stop < 0)
    throw ProtocolError(stop_path(socket).string() + ": " + std::strerror(errno) + ". Use the emergency stop");
  const std::string answer = line_of(stop, 2 * StopSocket::patience);
  close(stop);
  json said = json::parse(answer, nullptr, false);
  if (said.is_object() && said.contains("stopped")) return said;
  throw ProtocolError(stop_path(socket).string() + ": the stop is not answered. Use the emergency stop");
}

std::filesystem::path socket_to_listen() {
  if (const auto own = users_socket(); !own.empty()) return own;
  std::error_code ignored;  // root without the service's tmpfiles.d: the folder is made, as that would
  std::filesystem::create_directory(system_socket().parent_path(), ignored);
  if (access(system_socket().parent_path().c_str(), W_OK | X_OK) == 0) return system_socket();
  throw ProtocolError(
      "no place for the socket: XDG_RUNTIME_DIR is not set and /run/emtb cannot be written. Give --socket PATH");
}

std::filesystem::path socket_to_call() {
  const auto own = users_socket();
  std::error_code ignored;
  return own.empty() || (!std::filesystem::exists(own, ignored) && std::filesystem::exists(system_socket(), ignored))
             ? system_socket()
             : own;
}

std::filesystem::path socket_to_call(const std::string& named) {
  return named.empty() ? socket_to_call() : std::filesystem::path(named);
}

}  // namespace emtb
