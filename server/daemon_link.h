#pragma once

#include <boost/asio/io_context.hpp>
#include <filesystem>
#include <functional>
#include <memory>
#include <string>

namespace emtb {

/// A connection to the daemon on behalf of one page: lines both ways, as they are. Where the daemon goes, it tries
/// again each second. What was asked of a daemon that is gone is not asked of the next one.
class DaemonLink {
 public:
  static constexpr std::size_t longest_line = std::size_t{4} << 20;   ///< [byte] that the daemon may say at once
  static constexpr std::size_t longest_queue = std::size_t{2} << 20;  ///< [byte] that wait to be sent to it

  struct Listeners {
    std::function<void(std::string line)> line;
    std::function<void(bool there, std::string why)> changed;
  };

  DaemonLink(boost::asio::io_context& context, std::filesystem::path socket, Listeners listeners);
  ~DaemonLink();
  DaemonLink(const DaemonLink&) = delete;
  DaemonLink& operator=(const DaemonLink&) = delete;

  bool connected() const noexcept;

  /// @return false: it is not there, or takes no more
  bool send(const std::string& line);

  /// Reads no further until told to: a page that is slow makes the daemon send less, not this process keep more.
  void pause(bool paused);

 private:
  struct Wire;
  std::shared_ptr<Wire> wire_;
};

}  // namespace emtb
