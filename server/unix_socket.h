#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "server/rpc.h"
#include "server/stop_socket.h"

namespace emtb {

/// Lines over a Unix socket, many clients, on a thread of its own; and beside it SOCKET.stop (server/stop_socket.h).
///
/// A client that sends a line of more than 64 KiB (1 MiB for `run`), or does not read what it is sent, is dropped;
/// nobody waits for it. The end of a connection is seen at once, whatever was sent before and is not yet answered.
/// One that asks faster than most_requests is answered at that rate. Where all places are taken, a newcomer gets that
/// of the oldest client who has never asked anything; where there is none such, it is refused.
class UnixSocketServer {
 public:
  static constexpr std::size_t longest_line = 64 * 1024;    // [byte]
  static constexpr std::size_t longest_run = 1024 * 1024;   // [byte] of a request for `run`, with its profile's points
  static constexpr std::size_t longest_queue = 256 * 1024;  // [byte] unsent to one client; beyond: dropped
  static constexpr std::size_t most_clients = 64;
  static constexpr double most_requests = 1000;  // [1/s] of one client, which may save up a second's

  /// All but `stop` called on the server's thread.
  struct Handlers {
    std::function<rpc::Reply(std::string_view line, const rpc::Peer&)> line;
    std::function<void(const rpc::Peer&)> gone;              ///< a client's connection ended
    std::function<std::string(std::uint64_t peer)> live;     ///< what this subscriber is sent
    std::function<std::string(std::uint64_t peer)> block{};  ///< what one that is streamed to is sent; empty: nothing
    StopSocket::Handlers stop{};  ///< on a thread of their own; empty: to connect does nothing
  };

  /// Takes the path (mode 0660, group emtb where there is one); the socket file of a dead daemon is replaced.
  /// @throws ProtocolError where a living daemon answers there, or the path cannot be had.
  explicit UnixSocketServer(const std::filesystem::path& path);
  ~UnixSocketServer();  ///< stops, and removes the socket files

  void start(Handlers handlers);

  /// Ends the thread and closes every connection; no handler is called any more.
  void stop();

  /// Sends live() to this client every `period` [s] from now on, and all that is published. Only from within a handler.
  void subscribe(std::uint64_t peer, double period);

  /// The same with block(). A slow reader gets fewer, larger ones.
  void stream(std::uint64_t peer, double period);

  /// Sends a line to all subscribers. From any thread.
  void publish(std::string line);

  /// Who is connected. Only from within a handler.
  std::vector<rpc::Peer> clients() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace emtb
