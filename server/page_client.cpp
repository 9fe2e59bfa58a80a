#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/websocket/stream.hpp>
#include <chrono>
#include <deque>
#include <memory>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "server/daemon_link.h"
#include "server/page_checks.h"
#include "server/page_impl.h"
#include "server/rpc.h"

namespace emtb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using boost::system::error_code;
using nlohmann::json;
using rpc::Refusal;

/// Of the daemon's methods, those that move the motor or let it move on.
const std::set<std::string, std::less<>> moving{"run", "reset", "confirm"};

}  // namespace

/// One page: its WebSocket, and its connection to the daemon.
class PageClient : public std::enable_shared_from_this<PageClient> {
 public:
  PageClient(PageServer::Impl& server, beast::tcp_stream stream, bool may_move)
      : id(server.next_id++), server_(server), socket_(std::move(stream)), ping_(server.context), may_move_(may_move) {
    ++server_.connections;
  }

  ~PageClient() { --server_.connections; }

  void begin(const beast::http::request<beast::http::string_body>& upgrade) {
    beast::get_lowest_layer(socket_).expires_never();
    socket_.read_message_max(PageServer::longest_message);
    socket_.auto_fragment(false);
    socket_.text(true);
    socket_.control_callback([this](beast::websocket::frame_type kind, beast::string_view) {
      if (kind == beast::websocket::frame_type::pong) heard_ = std::chrono::steady_clock::now();
    });
    socket_.async_accept(upgrade, [self = shared_from_this()](const error_code& error) {
      if (error) return;
      self->server_.clients[self->id] = self;
      self->read();
      self->ping();
    });
  }

  void tell(std::string text) {
    if (closed_ || last_) return;
    queued_ += text.size();
    if (queued_ > PageServer::longest_queue) return close();  // it does not read
    queue_.push_back(std::move(text));
    if (queued_ > PageServer::slow_from && daemon_) daemon_->pause(true);
    if (queue_.size() == 1) write();
  }

  void close() {
    if (closed_) return;
    closed_ = true;
    ping_.cancel();
    daemon_.reset();  // a run of this page ends now
    beast::get_lowest_layer(socket_).close();
    server_.clients.erase(id);
    server_.work.forget(id);
  }

  const std::uint64_t id;

  bool greeted() const noexcept { return greeted_; }

 private:
  void read() {
    socket_.async_read(buffer_, [self = shared_from_this()](const error_code& error, std::size_t) {
      if (self->closed_) return;
      if (error) return self->close();
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->received(text);
      if (!self->closed_) self->read();
    });
  }

  void write() {
    socket_.async_write(asio::buffer(queue_.front()),
                        [self = shared_from_this()](const error_code& error, std::size_t) {
                          if (self->closed_) return;
                          if (error) return self->close();
                          self->queued_ -= self->queue_.front().size();
                          self->queue_.pop_front();
                          if (self->queued_ <= PageServer::slow_from && self->daemon_) self->daemon_->pause(false);
                          if (!self->queue_.empty()) return self->write();
                          if (self->last_) self->close();
                        });
  }

  void ping() {
    ping_.expires_after(std::chrono::seconds(1));
    ping_.async_wait([self = shared_from_this()](const error_code& error) {
      if (error || self->closed_) return;
      const std::chrono::duration<double> silent = std::chrono::steady_clock::now() - self->heard_;
      if (silent.count() > PageServer::silent_for || (!self->greeted_ && ++self->waited_ > 5)) return self->close();
      if (!self->pinging_) {
        self->pinging_ = true;
        self->socket_.async_ping({}, [self](const error_code&) { self->pinging_ = false; });
      }
      self->ping();
    });
  }

  void received(const std::string& text) {
    json request_id;
    try {
      const json request = rpc::parsed_request(text);
      request_id = request.value("id", json());
      answer(request, request_id);
    } catch (const Refusal& refusal) {
      tell(rpc::answer_error(request_id, refusal.code(), refusal.what()));
      last_ = last_ || stranger_;
    } catch (const std::exception& e) {
      tell(rpc::answer_error(request_id, rpc::code::internal_error, e.what()));
    }
  }

  void answer(const json& request, const json& request_id) {
    const std::string method = request["method"];
    const rpc::Params params(request["params"]);
    if (method == "hello") return tell(rpc::answer_result(request_id, hello(params)));
    if (!greeted_) throw Refusal(rpc::code::invalid_request, "say `hello` with the token first");
    if (method == "ping") return tell(rpc::answer_result(request_id, json::object()));
    if (method == "cancel") return tell(rpc::answer_result(request_id, {{"cancelled", server_.work.cancel()}}));
    if (const WorkMethod* work = server_.work.find(method)) {
      if (work->changes && !may_move_) refuse_to_move(method);
      return server_.work.submit(id, *work, request_id, request["params"]);
    }
    if (moving.contains(method) && !may_move_) refuse_to_move(method);
    forward(request);
  }

  [[noreturn]] static void refuse_to_move(const std::string& method) {
    throw Refusal(rpc::code::not_available,
                  "`" + method + "` is refused here: who comes by the address of --listen may look and stop");
  }

  json hello(const rpc::Params& params) {
    if (greeted_) throw Refusal(rpc::code::invalid_request, "this connection has said hello");
    if (!same_token(params.text_or("token", ""), server_.settings.token)) {
      stranger_ = true;
      throw Refusal(rpc::code::invalid_request,
                    "this page has not the token of this server. Open the address that `emtb page` printed");
    }
    greeted_ = true;
    const bool bench = !server_.settings.socket.empty();
    if (bench) meet_daemon();
    return {{"protocol", PageServer::protocol},        {"version", server_.settings.version}, {"bench", bench},
            {"daemon", bench && daemon_->connected()}, {"files", server_.settings.files},     {"may_move", may_move_}};
  }

  void meet_daemon() {
    daemon_ = std::make_unique<DaemonLink>(
        server_.context, server_.settings.socket,
        DaemonLink::Listeners{.line = [this](std::string line) { answered(std::move(line)); },
                              .changed =
                                  [this](bool there, const std::string& why) {
                                    if (!daemon_) return;  // hello says it
                                    tell(rpc::notification("daemon", {{"connected", there}, {"text", why}}));
                                    if (!there) {
                                      for (const std::string& asked : std::exchange(asked_, {})) {
                                        tell(rpc::answer_error(json::parse(asked), rpc::code::not_available, why));
                                      }
                                    }
                                  }});
  }

  void forward(const json& request) {
    if (!daemon_) {
      throw Refusal(rpc::code::not_available,
                    "`" + request["method"].get<std::string>() +
                        "` is asked of a bench, and no daemon is there: this page shows files");
    }
    if (!daemon_->send(request.dump(-1, ' ', false, json::error_handler_t::replace))) {
      throw Refusal(rpc::code::not_available, "no daemon answers at " + server_.settings.socket.string());
    }
    if (request.contains("id")) asked_.insert(request["id"].dump());
  }

  /// A line of the daemon's: an answer or a notification, passed on as it is.
  void answered(std::string line) {
    constexpr std::string_view id_key = "\"id\":";
    if (!asked_.empty() && !line.starts_with("{\"jsonrpc\"")) {  // a notification begins so, an answer does not
      const auto at = line.substr(0, 4096).find(id_key);
      if (at != std::string::npos) {
        const auto end = line.find_first_of(",}", at + id_key.size());
        asked_.erase(line.substr(at + id_key.size(), end - at - id_key.size()));
      }
    }
    tell(std::move(line));
  }

  friend void begin_page(PageServer::Impl&, beast::tcp_stream, beast::http::request<beast::http::string_body>, bool);

  PageServer::Impl& server_;
  beast::websocket::stream<beast::tcp_stream> socket_;
  asio::steady_timer ping_;
  const bool may_move_;
  std::chrono::steady_clock::time_point heard_ = std::chrono::steady_clock::now();
  beast::flat_buffer buffer_;
  std::deque<std::string> queue_;
  std::size_t queued_ = 0;       // [byte]
  std::set<std::string> asked_;  // ids of what the daemon has not answered
  std::unique_ptr<DaemonLink> daemon_;
  int waited_ = 0;  // [s] for its hello
  bool greeted_ = false, pinging_ = false, last_ = false, stranger_ = false, closed_ = false;
};

void begin_page(PageServer::Impl& server, beast::tcp_stream stream,
                beast::http::request<beast::http::string_body> upgrade, bool may_move) {
  std::make_shared<PageClient>(server, std::move(stream), may_move)->begin(upgrade);
}

void tell_page(PageServer::Impl& server, std::uint64_t client, std::string text) {
  const auto found = server.clients.find(client);
  if (found == server.clients.end()) return;
  if (const auto page = found->second.lock()) page->tell(std::move(text));
}

void tell_pages(PageServer::Impl& server, std::optional<std::uint64_t> but, const std::string& text) {
  const auto pages = server.clients;  // a slow one is closed while we tell
  for (const auto& [id, weak] : pages) {
    const auto page = weak.lock();
    if (page && page->greeted() && id != but) page->tell(text);
  }
}

void close_pages(PageServer::Impl& server) {
  const auto pages = server.clients;
  for (const auto& [id, weak] : pages) {
    if (const auto page = weak.lock()) page->close();
  }
}

}  // namespace emtb
