#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <thread>

#include "server/listening.h"

namespace emtb {

/// What came of a stop.
struct Stopped {
  std::uint64_t run = 0;  ///< that it ended; 0: none was on
  bool safe = false;      ///< the reference
};

/// SOCKET.stop: to connect is to stop, whatever is or is not sent. One line answers when the reference is safe:
///
///     {"stopped": 3, "reference_safe": true}
///
/// Its thread has a table of descriptors of its own, so that nobody's connections use them up, and allocates nothing.
class StopSocket {
 public:
  static constexpr std::size_t at_once = 64;  ///< callers that are answered together; more of them a moment later
  static constexpr double patience = 5;       ///< [s] for the loop to say that the reference is safe

  /// Called on this socket's thread; neither may wait or allocate.
  struct Handlers {
    std::function<std::uint64_t()> stop;                                  ///< asks for a stop; gives its number
    std::function<std::optional<Stopped>(std::uint64_t number)> stopped;  ///< nothing: not yet
  };

  /// @throws ProtocolError as Listening
  explicit StopSocket(const std::filesystem::path& path);
  ~StopSocket();

  void start(Handlers handlers);
  void stop();  ///< ends the thread

 private:
  void work();
  void serve();
  Stopped ask() const;

  Listening listening_;
  int wake_ = -1;
  std::atomic<bool> ending_{false};
  Handlers handlers_;
  std::thread thread_;
};

/// Where the stop of a daemon listens.
std::filesystem::path stop_path(const std::filesystem::path& socket);

}  // namespace emtb
