#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/work_queue.h"

namespace emtb {

/// A file of the page.
struct PageFile {
  std::string bytes;
  std::string type;  ///< for Content-Type
};

/// The page's server: HTTP, and a WebSocket for each page. docs/protocol.md, "The page", says what is spoken.
///
/// All of it runs on one thread, that of run(); the worker computes in a process of its own, and `POST /stop` waits on
/// threads of its own. Nothing here is unbounded: messages, what waits for a reader, connections, requests.
class PageServer {
 public:
  static constexpr int protocol = 1;
  static constexpr std::size_t longest_message = std::size_t{1} << 20;  ///< [byte] from a page
  static constexpr std::size_t longest_queue = std::size_t{4} << 20;    ///< [byte] that wait for a page; beyond: closed
  static constexpr std::size_t slow_from = longest_queue / 16;          ///< [byte] from which the daemon is to wait
  static constexpr std::size_t largest_import = std::size_t{1} << 30;   ///< [byte]
  static constexpr std::size_t most_connections = 64;
  static constexpr double silent_for = 3;  ///< [s] without a pong: closed

  struct Settings {
    std::uint16_t port = 8088;  ///< 0: any that is free
    std::string listen;         ///< an address besides loopback; empty: none
    std::string token;
    std::string version;
    std::filesystem::path socket;  ///< of the daemon; empty: no bench
    bool files = false;
    std::filesystem::path imports;    ///< the folder for imported files
    std::vector<std::string> worker;  ///< what starts the worker, argv[0] and all
    std::vector<WorkMethod> methods;  ///< that it answers
    std::function<std::optional<PageFile>(std::string_view path)> file;
  };

  /// Listens from now on. @throws ProtocolError where the port cannot be had
  explicit PageServer(Settings settings);
  ~PageServer();

  std::uint16_t port() const noexcept;

  /// Serves until SIGINT, SIGTERM or stop().
  void run();
  void stop();  ///< from any thread

  struct Impl;

 private:
  std::unique_ptr<Impl> impl_;
};

}  // namespace emtb
