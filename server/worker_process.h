#pragma once

#include <sys/types.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

namespace emtb {

/// A child process that speaks in lines over a socket at its descriptor 3: low priority, limited memory. It dies with
/// its parent.
class WorkerProcess {
 public:
  static constexpr int channel = 3;                                   ///< the child's descriptor
  static constexpr std::size_t longest_line = std::size_t{64} << 20;  ///< [byte] that it may say at once
  static constexpr std::size_t most_memory = std::size_t{8} << 30;    ///< [byte] of its address space
  static constexpr int niceness = 10;

  struct Listeners {
    std::function<void(std::string line)> line;
    std::function<void(std::string how)> ended;  ///< in words; not after stop()
  };

  /// @param argv the program and its arguments
  WorkerProcess(boost::asio::io_context& context, std::vector<std::string> argv, Listeners listeners);
  ~WorkerProcess();
  WorkerProcess(const WorkerProcess&) = delete;
  WorkerProcess& operator=(const WorkerProcess&) = delete;

  /// Starts it where it does not run. @throws Error where that cannot be
  void start();
  void send(std::string line);
  /// Ends it at once; ended() is not called.
  void stop();
  bool running() const noexcept { return pid_ > 0; }

 private:
  struct Wire;
  void over();

  boost::asio::io_context& context_;
  const std::vector<std::string> argv_;
  const Listeners listeners_;
  std::shared_ptr<Wire> wire_;
  pid_t pid_ = 0;
};

}  // namespace emtb
