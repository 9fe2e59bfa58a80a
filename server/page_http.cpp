#include <boost/asio/post.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <cctype>
#include <nlohmann/json.hpp>
#include <optional>

#include "hal/error.h"
#include "server/client.h"
#include "server/page_checks.h"
#include "server/page_impl.h"

namespace emtb {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
using boost::system::error_code;
using nlohmann::json;

constexpr auto patience = std::chrono::seconds(30);
constexpr std::size_t longest_header = 8192;  // [byte]
constexpr const char* policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; img-src 'self' data: blob:; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

std::string_view view(beast::string_view text) { return {text.data(), text.size()}; }

/// A file's name as it may stand in the folder of imports: no path, no dot in front.
std::optional<std::string> import_name(std::string_view target) {
  const auto at = target.find("?name=");
  if (at == std::string_view::npos) return {};
  std::string name;
  for (std::size_t i = at + 6; i < target.size(); ++i) {
    char c = target[i];
    if (c == '%' && i + 2 < target.size() && std::isxdigit(static_cast<unsigned char>(target[i + 1])) != 0 &&
        std::isxdigit(static_cast<unsigned char>(target[i + 2])) != 0) {
      c = static_cast<char>(std::stoi(std::string(target.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    }
    const bool plain = std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '.' || c == '_';
    name += plain ? c : '_';
  }
  if (name.size() > 100 || name.size() < 5 || name.front() == '.' || !name.ends_with(".csv")) return {};
  return name;
}

/// One HTTP connection: request after request, until one becomes a WebSocket.
class HttpConnection : public std::enable_shared_from_this<HttpConnection> {
 public:
  HttpConnection(PageServer::Impl& server, asio::ip::tcp::socket socket)
      : server_(server), local_(is_loopback(socket)), stream_(std::move(socket)) {
    ++server_.connections;
  }
  ~HttpConnection() { --server_.connections; }

  void read() {
    head_.emplace();
    head_->header_limit(longest_header);
    head_->body_limit(PageServer::largest_import);
    stream_.expires_after(patience);
    http::async_read_header(stream_, buffer_, *head_,
                            [self = shared_from_this()](const error_code& error, std::size_t) {
                              if (error) return self->close();
                              self->requested();
                            });
  }

 private:
  static bool is_loopback(const asio::ip::tcp::socket& socket) {
    error_code error;
    const auto end = socket.local_endpoint(error);
    const auto address = end.address();
    return !error && (address == asio::ip::address(asio::ip::address_v4::loopback()) ||
                      address == asio::ip::address(asio::ip::address_v6::loopback()));
  }

  void close() {
    error_code ignored;
    stream_.socket().shutdown(asio::ip::tcp::socket::shutdown_both, ignored);
    stream_.close();
  }

  /// The header is there, and nothing of it is believed yet.
  void requested() {
    const auto& request = head_->get();
    const std::string_view host = view(request[http::field::host]), origin = view(request[http::field::origin]);
    const std::string_view target = view(request.target());
    if (!host_allowed(host, server_.settings.listen)) {
      return refuse(http::status::forbidden,
                    "This server answers to localhost, 127.0.0.1 and [::1], at any port; not to another name.");
    }
    const bool upgrade = beast::websocket::is_upgrade(request);
    const bool acts = upgrade || request.method() != http::verb::get;
    if (acts ? !origin_matches(origin, host) : !origin.empty() && !origin_matches(origin, host)) {
      return refuse(http::status::forbidden, "Another site asked for this: refused.");
    }
    const std::string_view path = target.substr(0, target.find('?'));
    if (upgrade && path == "/ws") return become_page();
    if (request.method() == http::verb::post && path == "/stop") return stop();
    if (request.method() == http::verb::put && path == "/import") return import(target);
    if (request.method() != http::verb::get) return refuse(http::status::method_not_allowed, "GET, please.");
    const auto file = server_.settings.file(path);
    if (!file) return refuse(http::status::not_found, "Nothing is here. The page is at /.");
    respond(http::status::ok, file->type, file->bytes);
  }

  void become_page() {
    http::request<http::string_body> upgrade(head_->get().base());
    begin_page(server_, std::move(stream_), std::move(upgrade), local_);
  }

  /// To stop needs no token: anybody may. Waits on another thread.
  void stop() {
    if (server_.settings.socket.empty()) {
      return respond(http::status::service_unavailable, "application/json",
                     json{{"error", "this page shows files: there is no bench to stop"}}.dump());
    }
    stream_.expires_after(patience);
    asio::post(server_.stops, [self = shared_from_this()] {
      auto status = http::status::ok;
      json answer;
      try {
        answer = stop_now(self->server_.settings.socket);
      } catch (const std::exception& e) {
        status = http::status::service_unavailable;
        answer = {{"error", e.what()}};
      }
      asio::post(self->server_.context,
                 [self, status, text = answer.dump()] { self->respond(status, "application/json", text); });
    });
  }

  /// A file, streamed to the folder of imports.
  void import(std::string_view target) {
    const auto name = import_name(target);
    if (!name) return refuse(http::status::bad_request, "Give the name of a .csv file: /import?name=NAME.csv");
    if (!local_ || !same_token(view(head_->get()["X-Emtb-Token"]), server_.settings.token)) {
      return refuse(http::status::forbidden, "The token of this server is missing.");
    }
    std::error_code made;
    std::filesystem::create_directories(server_.settings.imports, made);
    imported_ = server_.settings.imports / *name;
    file_.emplace(std::move(*head_));
    file_->body_limit(PageServer::largest_import);
    error_code error;
    file_->get().body().open((imported_.string() + ".part").c_str(), beast::file_mode::write, error);
    if (error) return refuse(http::status::internal_server_error, imported_.string() + ": " + error.message());
    receive();
  }

  void receive() {
    stream_.expires_after(patience);
    http::async_read_some(stream_, buffer_, *file_, [self = shared_from_this()](const error_code& error, std::size_t) {
      if (error) return self->import_failed(error);
      if (!self->file_->is_done()) return self->receive();
      self->file_->get().body().close();
      std::error_code moved;
      std::filesystem::rename(self->imported_.string() + ".part", self->imported_, moved);
      if (moved) return self->refuse(http::status::internal_server_error, moved.message());
      self->respond(http::status::ok, "application/json", json{{"path", self->imported_.string()}}.dump());
    });
  }

  void import_failed(const error_code& error) {
    file_->get().body().close();
    std::error_code ignored;
    std::filesystem::remove(imported_.string() + ".part", ignored);
    if (error == http::error::body_limit) return refuse(http::status::payload_too_large, "1 GiB is the most.");
    close();
  }

  void refuse(http::status status, const std::string& why) {
    respond(status, "text/plain; charset=utf-8", why + "\n", true);
  }

  /// @param last what came behind the header is not read: the connection ends
  void respond(http::status status, const std::string& type, std::string body, bool last = false) {
    answer_.emplace();
    answer_->result(status);
    answer_->version(11);
    answer_->set(http::field::content_type, type);
    answer_->set(http::field::cache_control, "no-store");
    answer_->set("Content-Security-Policy", policy);
    answer_->set("X-Content-Type-Options", "nosniff");
    answer_->set("Referrer-Policy", "no-referrer");
    answer_->set("Cross-Origin-Opener-Policy", "same-origin");
    answer_->set("Cross-Origin-Resource-Policy", "same-origin");
    const bool read_whole = head_ && head_->is_done();
    answer_->keep_alive(!last && read_whole && head_->get().keep_alive());
    answer_->body() = std::move(body);
    answer_->prepare_payload();
    stream_.expires_after(patience);
    http::async_write(stream_, *answer_, [self = shared_from_this()](const error_code& error, std::size_t) {
      if (error || !self->answer_->keep_alive()) return self->close();
      self->read();
    });
  }

  PageServer::Impl& server_;
  const bool local_;  // came by a loopback address
  beast::tcp_stream stream_;
  beast::flat_buffer buffer_{65536 + longest_header};
  std::optional<http::request_parser<http::empty_body>> head_;
  std::optional<http::request_parser<http::file_body>> file_;
  std::optional<http::response<http::string_body>> answer_;
  std::filesystem::path imported_;
};

}  // namespace

void PageServer::Impl::serve_http(asio::ip::tcp::socket socket) {
  error_code ignored;
  socket.set_option(asio::ip::tcp::no_delay(true), ignored);
  std::make_shared<HttpConnection>(*this, std::move(socket))->read();
}

}  // namespace emtb
