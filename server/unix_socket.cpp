#include "server/unix_socket.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <new>
#include <thread>

#include "server/listening.h"

namespace emtb {
namespace {

namespace asio = boost::asio;
using Protocol = asio::local::stream_protocol;
using boost::system::error_code;

rpc::Peer credentials(Protocol::socket& socket, std::uint64_t id) {
  ucred who{};
  socklen_t size = sizeof who;
  if (getsockopt(socket.native_handle(), SOL_SOCKET, SO_PEERCRED, &who, &size) != 0) return {.id = id};
  return {.id = id, .pid = who.pid, .uid = who.uid, .gid = who.gid};
}

/// Whether nobody is at the other end any more, though what he sent may wait here yet.
bool has_ended(Protocol::socket& socket) {
  pollfd state{.fd = socket.native_handle(), .events = 0, .revents = 0};
  return poll(&state, 1, 0) > 0 && (state.revents & (POLLHUP | POLLERR)) != 0;
}

}  // namespace

struct UnixSocketServer::Impl {
  struct Client : std::enable_shared_from_this<Client> {
    Client(Impl& server, Protocol::socket from, std::uint64_t id)
        : owner(server),
          socket(std::move(from)),
          peer(credentials(socket, id)),
          timer(server.context),
          blocks(server.context),
          rest(server.context) {}

    /// Does what came due. Without the memory for it this connection ends, and no other: its client sees that.
    template <class Work>
    void or_close(Work work) {
      try {
        work();
      } catch (const std::bad_alloc&) {
        close();
      }
    }

    /// The end of the connection is told even while we rest from the client's requests.
    void watch_end() {
      socket.async_wait(Protocol::socket::wait_error, [self = shared_from_this()](const error_code& error) {
        if (error || self->closed) return;
        if (!has_ended(self->socket)) return self->close();  // data out of band: not this protocol
        self->or_close([&] { self->ended(); });
      });
    }

    /// Nobody is there any more. What was asked with the last breath still counts; a flood does not.
    void ended() {
      if (over) return;
      over = true;
      queue.resize(std::min<std::size_t>(queue.size(), 1));  // what is being written must stand until it has failed
      if (!reading) close();
    }

    /// Reads on, once the client has a request left to spend.
    void read_on() {
      if (over) return last_breath-- > 0 ? read() : close();
      const auto now = std::chrono::steady_clock::now();
      left = std::min(most_requests, left + most_requests * std::chrono::duration<double>(now - counted).count()) - 1;
      counted = now;
      if (left >= 0) return read();
      rest.expires_after(std::chrono::milliseconds(10));
      rest.async_wait([self = shared_from_this()](const error_code& error) {
        if (!error && !self->closed) self->or_close([&] { self->read(); });
      });
    }

    void read() {
      reading = true;
      asio::async_read_until(socket, asio::dynamic_buffer(input, longest + 1), '\n',
                             [self = shared_from_this()](const error_code& error, std::size_t size) {
                               self->or_close([&] { self->received(error, size); });
                             });
    }

    void received(const error_code& error, std::size_t size) {
      reading = false;
      if (closed) return;
      if (error == asio::error::not_found) return too_long();
      if (error) return close();
      std::string_view line(input.data(), size - 1);
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      rpc::Reply reply = line.empty() ? rpc::Reply() : owner.handlers.line(line, peer);
      input.erase(0, size);
      longest = longest_line;
      asked = true;
      if (reply.later) return wait_for(std::move(reply.later));
      if (!reply.line.empty()) send(std::move(reply.line));
      if (!closed) read_on();
    }

    /// The buffer is full without a newline.
    void too_long() {
      if (longest < longest_run && rpc::begins_request(input, "run")) {
        longest = longest_run;
        return read();
      }
      send(rpc::error_line(rpc::code::invalid_request, "a line is longer than " + std::to_string(longest) + " bytes"));
      last = true;
      if (over) close();
    }

    /// An answer that is not there yet keeps back this client's further requests, and nobody else's.
    void wait_for(std::function<std::string()> later) {
      rest.expires_after(std::chrono::milliseconds(1));
      rest.async_wait([self = shared_from_this(), later = std::move(later)](const error_code& error) mutable {
        if (error || self->closed) return;
        self->or_close([&] {
          std::string answer = later();
          if (answer.empty()) return self->wait_for(std::move(later));
          self->send(std::move(answer));
          if (!self->closed) self->read_on();
        });
      });
    }

    void send(std::string line) {
      if (closed || last || over) return;
      line += '\n';
      queued += line.size();
      if (queued > longest_queue) return close();  // it does not read
      queue.push_back(std::move(line));
      if (queue.size() == 1) write();
    }

    void write() {
      asio::async_write(socket, asio::buffer(queue.front()),
                        [self = shared_from_this()](const error_code& error, std::size_t) {
                          if (self->closed) return;
                          if (self->over) return self->queue.clear();
                          if (error && has_ended(self->socket)) return self->ended();
                          if (error) return self->close();
                          self->queued -= self->queue.front().size();
                          self->queue.pop_front();
                          if (!self->queue.empty()) return self->or_close([&] { self->write(); });
                          if (self->last) self->close();
                        });
    }

    void show_live() {
      timer.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(period));
      timer.async_wait([self = shared_from_this()](const error_code& error) {
        if (error || self->closed) return;
        self->or_close([&] {
          if (self->queue.empty())
            self->send(self->owner.handlers.live(self->peer.id));  // a slow reader gets fewer, not older ones
          self->show_live();
        });
      });
    }

    void show_blocks() {
      blocks.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(block_period));
      blocks.async_wait([self = shared_from_this()](const error_code& error) {
        if (error || self->closed) return;
        self->or_close([&] {
          if (self->queue.empty()) {
            if (std::string line = self->owner.handlers.block(self->peer.id); !line.empty())
              self->send(std::move(line));
          }
          self->show_blocks();
        });
      });
    }

    void close() {
      if (closed) return;
      closed = true;
      error_code ignored;
      timer.cancel(ignored);
      blocks.cancel(ignored);
      rest.cancel(ignored);
      socket.close(ignored);
      const auto self = shared_from_this();  // erase() may hold the last reference
      owner.clients.erase(peer.id);
      if (owner.handlers.gone) owner.handlers.gone(peer);
    }

    Impl& owner;
    Protocol::socket socket;
    rpc::Peer peer;
    asio::steady_timer timer;
    asio::steady_timer blocks;
    asio::steady_timer rest;
    double left = most_requests;  // that it may send at once
    std::chrono::steady_clock::time_point counted = std::chrono::steady_clock::now();
    bool asked = false;                       // at least one line came
    std::chrono::duration<double> period{0};  // 0: not subscribed
    std::chrono::duration<double> block_period{0};
    std::string input;
    std::deque<std::string> queue;
    std::size_t queued = 0;              // [byte]
    std::size_t longest = longest_line;  // [byte] that the line which comes may have
    bool reading = false;
    bool last = false;     // closes once the queue is sent
    bool over = false;     // nobody is at the other end
    int last_breath = 16;  // lines that still count then
    bool closed = false;
  };

  /// Waits for the next who connects.
  void accept() {
    acceptor.async_accept([this](const error_code& error, Protocol::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) {  // no file descriptors left: try again when some may be free
        retry.expires_after(std::chrono::milliseconds(100));
        retry.async_wait([this](const error_code& stopped) {
          if (!stopped) accept();
        });
        return;
      }
      if (clients.size() >= most_clients) drop_one_who_never_asked();
      if (clients.size() < most_clients) let_in(std::move(socket));
      accept();
    });
  }

  /// The server's thread. Whoever there is no memory for is not let in, and the next one is waited for all the same.
  void work() {
    const auto until_stopped =
        asio::make_work_guard(context);  // a handler that threw may have been all there was to do
    while (!context.stopped()) {
      try {
        accept();
        context.run();
      } catch (const std::bad_alloc&) {  // whether the next is still waited for, nobody knows: it begins anew
        error_code ignored;
        acceptor.cancel(ignored);
        retry.cancel();
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
      }
    }
  }

  void let_in(Protocol::socket socket) {
    const auto client = std::make_shared<Client>(*this, std::move(socket), next_id++);
    clients[client->peer.id] = client;
    client->or_close([&] {
      client->watch_end();
      if (!client->closed) client->read();
    });
  }

  void drop_one_who_never_asked() {
    for (const auto& [id, client] : clients) {  // by age
      if (!client->asked) return client->close();
    }
  }

  explicit Impl(const std::filesystem::path& path) : listening(path), stop(stop_path(path)) {
    // A descriptor of its own for the acceptor, which closes it; the file goes with `listening`.
    acceptor.assign(Protocol(), fcntl(listening.descriptor(), F_DUPFD_CLOEXEC, 0));
  }

  const Listening listening;
  StopSocket stop;
  asio::io_context context{1};
  Protocol::acceptor acceptor{context};
  asio::steady_timer retry{context};
  Handlers handlers;
  std::map<std::uint64_t, std::shared_ptr<Client>> clients;
  std::uint64_t next_id = 1;
  std::thread thread;
};

UnixSocketServer::UnixSocketServer(const std::filesystem::path& path) : impl_(std::make_unique<Impl>(path)) {}

UnixSocketServer::~UnixSocketServer() { stop(); }

void UnixSocketServer::stop() {
  impl_->stop.stop();
  if (impl_->thread.joinable()) {
    impl_->context.stop();
    impl_->thread.join();
  }
  impl_->handlers = {};
  while (!impl_->clients.empty()) impl_->clients.begin()->second->close();
}

void UnixSocketServer::start(Handlers handlers) {
  impl_->handlers = std::move(handlers);
  if (impl_->handlers.stop.stop) impl_->stop.start(impl_->handlers.stop);
  impl_->thread = std::thread([impl = impl_.get()] { impl->work(); });
}

void UnixSocketServer::subscribe(std::uint64_t peer, double period) {
  const auto found = impl_->clients.find(peer);
  if (found == impl_->clients.end()) return;
  found->second->period = std::chrono::duration<double>(period);
  found->second->show_live();
}

void UnixSocketServer::stream(std::uint64_t peer, double period) {
  const auto found = impl_->clients.find(peer);
  if (found == impl_->clients.end() || !impl_->handlers.block) return;
  found->second->block_period = std::chrono::duration<double>(period);
  found->second->show_blocks();
}

void UnixSocketServer::publish(std::string line) {
  asio::post(impl_->context, [impl = impl_.get(), line = std::move(line)] {
    for (auto at = impl->clients.begin(); at != impl->clients.end();) {
      const auto client = (at++)->second;  // a slow one is dropped while we send
      if (client->period.count() > 0) client->or_close([&] { client->send(line); });
    }
  });
}

std::vector<rpc::Peer> UnixSocketServer::clients() const {
  std::vector<rpc::Peer> peers;
  for (const auto& [id, client] : impl_->clients) peers.push_back(client->peer);
  return peers;
}

}  // namespace emtb
