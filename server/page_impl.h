#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>
#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "server/page_server.h"

namespace emtb {

class PageClient;

/// What the connections of the page's server share. All of it on the server's thread.
struct PageServer::Impl {
  explicit Impl(Settings given);

  void listen(const std::string& address, std::uint16_t at);
  void accept(boost::asio::ip::tcp::acceptor& acceptor);

  /// One more HTTP connection, which may become a WebSocket.
  void serve_http(boost::asio::ip::tcp::socket socket);

  const Settings settings;
  boost::asio::io_context context{1};
  boost::asio::signal_set signals{context};
  std::vector<std::unique_ptr<boost::asio::ip::tcp::acceptor>> acceptors;
  WorkQueue work;
  std::map<std::uint64_t, std::weak_ptr<PageClient>> clients;
  std::uint64_t next_id = 1;
  std::size_t connections = 0;
  boost::asio::thread_pool stops{4};  ///< waits for the daemon's stop, and for nothing else
  std::uint16_t port = 0;
};

/// A WebSocket whose handshake has been asked for and whose origin is right.
/// @param may_move not by an address of --listen
void begin_page(PageServer::Impl& server, boost::beast::tcp_stream stream,
                boost::beast::http::request<boost::beast::http::string_body> upgrade, bool may_move);

/// What a client of the work queue is told.
void tell_page(PageServer::Impl& server, std::uint64_t client, std::string text);
void tell_pages(PageServer::Impl& server, std::optional<std::uint64_t> but, const std::string& text);
void close_pages(PageServer::Impl& server);

}  // namespace emtb
