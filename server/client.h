#pragma once

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>

#include "server/rpc.h"

namespace emtb {

/// The other end of the socket, for the command line: one request at a time, notifications in between.
class Client {
 public:
  /// @throws ProtocolError where nobody answers, saying how to start the daemon.
  explicit Client(const std::filesystem::path& socket);
  ~Client();
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  /// Before anything may move, the daemon is asked for its protocol.
  /// @param params an object, or null for none
  /// @return the result. @throws rpc::Refusal with the daemon's code and message; ProtocolError where it is gone, or
  /// speaks a protocol newer than ours.
  nlohmann::json call(const std::string& method, const nlohmann::json& params);

  const std::filesystem::path& path() const noexcept { return path_; }

  /// The next notification: `{"method": ..., "params": ...}`, or nothing within `timeout` [s] or at a signal.
  /// @throws ProtocolError where the daemon is gone.
  std::optional<nlohmann::json> notification(double timeout);

 private:
  nlohmann::json ask(const std::string& method, const nlohmann::json& params);
  /// @return false at the time-out, or where a signal arrived.
  bool fill(double timeout);
  std::optional<std::string> line();
  void send(const std::string& text);

  std::filesystem::path path_;
  int socket_ = -1;
  std::string input_;
  std::string kept_;  // notifications that came before an answer, one a line
  int id_ = 0;
  bool known_ = false;  ///< the daemon has told its protocol
};

/// The daemon that listens there: it is waited for a second, for it may only just have been started.
/// @param named its socket; empty: socket_to_call()
/// @throws ProtocolError where nobody answers
Client daemon_at(const std::string& named);

/// Stops what is on, by the socket that is there for nothing else; a daemon that has none is asked by its method.
/// @return `stopped`: the run that ended, or null; `reference_safe`
/// @throws ProtocolError where nobody answers
nlohmann::json stop_now(const std::filesystem::path& socket);

/// Where the daemon listens unless told otherwise: $XDG_RUNTIME_DIR/emtb.sock, or /run/emtb/emtb.sock where that can be
/// made.
/// @throws ProtocolError where neither can.
std::filesystem::path socket_to_listen();

/// Where the command line looks for it: the same places, whichever has a socket.
std::filesystem::path socket_to_call();

/// The one that was named; empty: socket_to_call().
std::filesystem::path socket_to_call(const std::string& named);

}  // namespace emtb
