#include "server/unix_socket.h"

#include <grp.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/buffer.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/local/stream_protocol.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/read_until.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <chrono>
#include <deque>
#include <map>
#include <thread>

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

/// Binds with mode 0660 from the first moment: chmod afterwards would leave a gap.
void bind(Protocol::acceptor& acceptor, const Protocol::endpoint& endpoint) {
  const mode_t before = umask(0117);
  error_code error;
  acceptor.bind(endpoint, error);
  umask(before);
  if (error) throw ProtocolError(endpoint.path() + ": the socket cannot be made: " + error.message());
}

}  // namespace

struct UnixSocketServer::Impl {
  struct Client : std::enable_shared_from_this<Client> {
    Client(Impl& server, Protocol::socket from, std::uint64_t id)
        : owner(server),
          socket(std::move(from)),
          peer(credentials(socket, id)),
          timer(server.context),
          rest(server.context) {}

    /// Reads on, once the client has a request left to spend.
    void read_on() {
      const auto now = std::chrono::steady_clock::now();
      left = std::min(most_requests, left + most_requests * std::chrono::duration<double>(now - counted).count()) - 1;
      counted = now;
      if (left >= 0) return read();
      rest.expires_after(std::chrono::milliseconds(10));
      rest.async_wait([self = shared_from_this()](const error_code& error) {
        if (!error && !self->closed) self->read();
      });
    }

    void read() {
      asio::async_read_until(
          socket, asio::dynamic_buffer(input, longest_line + 1), '\n',
          [self = shared_from_this()](const error_code& error, std::size_t size) { self->received(error, size); });
    }

    void received(const error_code& error, std::size_t size) {
      if (closed) return;
      if (error == asio::error::not_found) {  // the buffer is full without a newline
        send(rpc::error_line(rpc::code::invalid_request,
                             "a line is longer than " + std::to_string(longest_line) + " bytes"));
        last = true;
        return;
      }
      if (error) return close();
      std::string_view line(input.data(), size - 1);
      if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
      std::string answer = line.empty() ? std::string() : owner.handlers.line(line, peer);
      input.erase(0, size);
      asked = true;
      if (!answer.empty()) send(std::move(answer));
      if (!closed) read_on();
    }

    void send(std::string line) {
      if (closed || last) return;
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
                          if (error) return self->close();
                          self->queued -= self->queue.front().size();
                          self->queue.pop_front();
                          if (!self->queue.empty()) return self->write();
                          if (self->last) self->close();
                        });
    }

    void show_live() {
      timer.expires_after(std::chrono::duration_cast<std::chrono::steady_clock::duration>(period));
      timer.async_wait([self = shared_from_this()](const error_code& error) {
        if (error || self->closed) return;
        if (self->queue.empty())
          self->send(self->owner.handlers.live(self->peer.id));  // a slow reader gets fewer, not older ones
        self->show_live();
      });
    }

    void close() {
      if (closed) return;
      closed = true;
      error_code ignored;
      timer.cancel(ignored);
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
    asio::steady_timer rest;
    double left = most_requests;  // that it may send at once
    std::chrono::steady_clock::time_point counted = std::chrono::steady_clock::now();
    bool asked = false;                       // at least one line came
    std::chrono::duration<double> period{0};  // 0: not subscribed
    std::string input;
    std::deque<std::string> queue;
    std::size_t queued = 0;  // [byte]
    bool last = false;       // closes once the queue is sent
    bool closed = false;
  };

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
      if (clients.size() < most_clients) {
        const auto client = std::make_shared<Client>(*this, std::move(socket), next_id++);
        clients[client->peer.id] = client;
        client->read();
      }
      accept();
    });
  }

  void drop_one_who_never_asked() {
    for (const auto& [id, client] : clients) {  // by age
      if (!client->asked) return client->close();
    }
  }

  std::filesystem::path path;
  asio::io_context context{1};
  Protocol::acceptor acceptor{context};
  asio::steady_timer retry{context};
  Handlers handlers;
  std::map<std::uint64_t, std::shared_ptr<Client>> clients;
  std::uint64_t next_id = 1;
  std::thread thread;
};

UnixSocketServer::UnixSocketServer(const std::filesystem::path& path) : impl_(std::make_unique<Impl>()) {
  impl_->path = path;
  const std::string name = path.string();
  if (name.size() >= sizeof(sockaddr_un::sun_path)) {
    throw ProtocolError(name + ": a socket's path has at most " + std::to_string(sizeof(sockaddr_un::sun_path) - 1) +
                        " bytes. Give a shorter --socket");
  }
  const Protocol::endpoint endpoint(name);
  std::error_code ignored;
  if (const auto status = std::filesystem::symlink_status(path, ignored); std::filesystem::exists(status)) {
    if (!std::filesystem::is_socket(status)) throw ProtocolError(name + ": is there already and is not a socket");
    Protocol::socket probe(impl_->context);
    error_code error;
    probe.connect(endpoint, error);
    if (!error) throw ProtocolError(name + ": another daemon answers there. Stop it, or give another --socket");
    if (error != asio::error::connection_refused) {
      throw ProtocolError(name + ": is there already: " + error.message());
    }
    std::filesystem::remove(path, ignored);  // its daemon is dead
  }
  impl_->acceptor.open();
  bind(impl_->acceptor, endpoint);
  if (const group* ours = getgrnam("emtb"); ours != nullptr && geteuid() == 0) {
    if (chown(name.c_str(), static_cast<uid_t>(-1), ours->gr_gid) != 0) { /* then it stays root's */
    }
  }
  impl_->acceptor.listen();
}

UnixSocketServer::~UnixSocketServer() {
  stop();
  std::error_code ignored;
  std::filesystem::remove(impl_->path, ignored);
}

void UnixSocketServer::stop() {
  if (impl_->thread.joinable()) {
    impl_->context.stop();
    impl_->thread.join();
  }
  impl_->handlers = {};
  while (!impl_->clients.empty()) impl_->clients.begin()->second->close();
}

void UnixSocketServer::start(Handlers handlers) {
  impl_->handlers = std::move(handlers);
  impl_->accept();
  impl_->thread = std::thread([impl = impl_.get()] { impl->context.run(); });
}

void UnixSocketServer::subscribe(std::uint64_t peer, double period) {
  const auto found = impl_->clients.find(peer);
  if (found == impl_->clients.end()) return;
  found->second->period = std::chrono::duration<double>(period);
  found->second->show_live();
}

void UnixSocketServer::publish(std::string line) {
  asio::post(impl_->context, [impl = impl_.get(), line = std::move(line)] {
    const auto clients = impl->clients;  // a slow one is dropped while we send
    for (const auto& [id, client] : clients) {
      if (client->period.count() > 0) client->send(line);
    }
  });
}

std::vector<rpc::Peer> UnixSocketServer::clients() const {
  std::vector<rpc::Peer> peers;
  for (const auto& [id, client] : impl_->clients) peers.push_back(client->peer);
  return peers;
}

}  // namespace emtb
