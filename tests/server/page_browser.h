#pragma once

#include <sys/socket.h>
#include <sys/time.h>

#include <boost/asio/connect.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace emtb {

/// What a browser does, without one: a request, or a WebSocket with a page on it.
inline boost::asio::ip::tcp::socket connected_to(boost::asio::io_context& context, std::uint16_t port,
                                                 const std::string& address = "127.0.0.1") {
  boost::asio::ip::tcp::socket socket(context);
  socket.connect({boost::asio::ip::make_address(address), port});
  const timeval patience{.tv_sec = 30, .tv_usec = 0};
  setsockopt(socket.native_handle(), SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  return socket;
}

struct HttpAnswer {
  unsigned status = 0;
  std::string body;
  boost::beast::http::response<boost::beast::http::string_body> whole;
};

struct HttpRequest {
  boost::beast::http::verb method = boost::beast::http::verb::get;
  std::string target = "/", host = "localhost", origin{}, token{}, body{};
};

inline HttpAnswer http(std::uint16_t port, const HttpRequest& asked) {
  namespace beast_http = boost::beast::http;
  boost::asio::io_context context;
  auto socket = connected_to(context, port);
  beast_http::request<beast_http::string_body> request(asked.method, asked.target, 11);
  request.set(beast_http::field::host, asked.host);
  if (!asked.origin.empty()) request.set(beast_http::field::origin, asked.origin);
  if (!asked.token.empty()) request.set("X-Emtb-Token", asked.token);
  request.body() = asked.body;
  request.prepare_payload();
  boost::system::error_code error;
  beast_http::write(socket, request, error);
  boost::beast::flat_buffer buffer;
  HttpAnswer answer;
  beast_http::response_parser<beast_http::string_body> parser;
  parser.body_limit(std::uint64_t{1} << 30);
  beast_http::read(socket, buffer, parser, error);
  if (!error) {
    answer.whole = parser.release();
    answer.status = answer.whole.result_int();
    answer.body = answer.whole.body();
  }
  return answer;
}

class Browser {
 public:
  explicit Browser(std::uint16_t port, const std::string& host = "localhost",
                   const std::string& origin = "http://localhost", const std::string& address = "127.0.0.1")
      : socket_(connected_to(context_, port, address)) {
    socket_.set_option(boost::beast::websocket::stream_base::decorator(
        [&](boost::beast::websocket::request_type& r) { r.set(boost::beast::http::field::origin, origin); }));
    socket_.read_message_max(std::size_t{64} << 20);
    boost::system::error_code error;
    socket_.handshake(host, "/ws", error);
    open = !error;
  }

  bool send(const std::string& text) {
    boost::system::error_code error;
    socket_.write(boost::asio::buffer(text), error);
    return !error;
  }

  /// The next message; nothing where the connection ended.
  std::optional<nlohmann::json> next() {
    boost::beast::flat_buffer buffer;
    boost::system::error_code error;
    socket_.read(buffer, error);
    if (error) return {};
    return nlohmann::json::parse(boost::beast::buffers_to_string(buffer.data()));
  }

  /// The whole answer; notifications before it are kept in `told`. Null where the connection ended.
  nlohmann::json ask(const std::string& method, const nlohmann::json& params = nlohmann::json::object()) {
    const int id = ++id_;
    send(nlohmann::json{{"jsonrpc", "2.0"}, {"id", id}, {"method", method}, {"params", params}}.dump());
    while (const auto message = next()) {
      if (message->contains("method")) {
        told.push_back(*message);
      } else if (message->value("id", nlohmann::json()) == id) {
        return *message;
      }
    }
    return nullptr;
  }

  /// The notification of that name, which came or comes.
  nlohmann::json notification(const std::string& method) {
    for (std::size_t seen = 0;; ++seen) {
      if (seen == told.size()) {
        const auto message = next();
        if (!message) return nullptr;
        told.push_back(*message);
      }
      if (told[seen].value("method", "") == method) return told[seen];
    }
  }

  bool open = false;
  std::vector<nlohmann::json> told;

 private:
  boost::asio::io_context context_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_;
  int id_ = 0;
};

}  // namespace emtb
