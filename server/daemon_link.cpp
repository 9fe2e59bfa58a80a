#include "server/daemon_link.h"

#include <boost/asio/buffer.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <deque>
#include <optional>

namespace emtb {

namespace asio = boost::asio;
using Protocol = asio::local::stream_protocol;
using boost::system::error_code;

struct DaemonLink::Wire : std::enable_shared_from_this<Wire> {
  Wire(asio::io_context& in, std::filesystem::path path, Listeners who)
      : socket(in), again(in), name(std::move(path)), listeners(std::move(who)) {}

  /// At once the first time, so that who greets us is told the truth; a Unix socket answers at once or not at all.
  void connect() {
    error_code error;
    socket = Protocol::socket(socket.get_executor());
    try {
      socket.connect(Protocol::endpoint(name.string()), error);
    } catch (const std::exception&) {  // the path is too long
      error = asio::error::invalid_argument;
    }
    if (error) return lost(error);
    there = true;
    if (told != std::optional(true)) {
      const bool back = told.has_value();
      told = true;
      if (back) listeners.changed(true, "");
    }
    read();
  }

  void read() {
    if (reading || paused || !there || over) return;
    reading = true;
    asio::async_read_until(socket, asio::dynamic_buffer(input, longest_line), '\n',
                           [self = shared_from_this()](const error_code& error, std::size_t size) {
                             self->reading = false;
                             if (self->over) return;
                             if (error) return self->lost(error);
                             std::string line = self->input.substr(0, size - 1);
                             self->input.erase(0, size);
                             self->listeners.line(std::move(line));
                             self->read();
                           });
  }

  void write() {
    writing = true;
    asio::async_write(socket, asio::buffer(queue.front()),
                      [self = shared_from_this()](const error_code& error, std::size_t size) {
                        self->writing = false;
                        if (self->over) return;
                        if (error) return;  // reading says so
                        self->queued -= size;
                        self->queue.pop_front();
                        if (!self->queue.empty()) self->write();
                      });
  }

  void lost(const error_code& error) {
    there = false;
    error_code ignored;
    socket.close(ignored);
    input.clear();
    if (!writing) queue.clear();
    queued = 0;
    const std::string why = name.string() + ": no daemon answers (" + error.message() + ")";
    if (told != std::optional(false)) {
      told = false;
      listeners.changed(false, why);
    }
    again.expires_after(std::chrono::seconds(1));
    again.async_wait([self = shared_from_this()](const error_code& stopped) {
      if (stopped || self->over) return;
      self->queue.clear();
      self->connect();
    });
  }

  Protocol::socket socket;
  asio::steady_timer again;
  const std::filesystem::path name;
  const Listeners listeners;
  std::string input;
  std::deque<std::string> queue;
  std::size_t queued = 0;    // [byte]
  std::optional<bool> told;  // whether it is there
  bool there = false, reading = false, writing = false, paused = false, over = false;
};

DaemonLink::DaemonLink(asio::io_context& context, std::filesystem::path socket, Listeners listeners)
    : wire_(std::make_shared<Wire>(context, std::move(socket), std::move(listeners))) {
  wire_->connect();
}

DaemonLink::~DaemonLink() {
  wire_->over = true;
  error_code ignored;
  wire_->again.cancel(ignored);
  wire_->socket.close(ignored);
}

bool DaemonLink::connected() const noexcept { return wire_->there; }

bool DaemonLink::send(const std::string& line) {
  if (!wire_->there || wire_->queued + line.size() > longest_queue) return false;
  wire_->queued += line.size() + 1;
  wire_->queue.push_back(line + "\n");
  if (!wire_->writing) wire_->write();
  return true;
}

void DaemonLink::pause(bool paused) {
  wire_->paused = paused;
  if (!paused) wire_->read();
}

}  // namespace emtb
