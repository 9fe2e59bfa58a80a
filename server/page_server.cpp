#include "server/page_server.h"

#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/post.hpp>
#include <csignal>

#include "hal/error.h"
#include "server/page_impl.h"

namespace emtb {

namespace asio = boost::asio;
using asio::ip::tcp;
using boost::system::error_code;

PageServer::Impl::Impl(Settings given)
    : settings(std::move(given)),
      work(context, settings.worker, settings.methods,
           {.tell = [this](std::uint64_t client, std::string text) { tell_page(*this, client, std::move(text)); },
            .tell_all = [this](std::optional<std::uint64_t> but,
                               const std::string& text) { tell_pages(*this, but, text); }}) {}

void PageServer::Impl::listen(const std::string& address, std::uint16_t at) {
  error_code error;
  const auto where = asio::ip::make_address(address, error);
  if (error) throw ProtocolError("--listen " + address + ": no address of this computer");
  const tcp::endpoint endpoint(where, at);
  auto acceptor = std::make_unique<tcp::acceptor>(context);
  acceptor->open(endpoint.protocol(), error);
  if (!error && where.is_v6()) acceptor->set_option(asio::ip::v6_only(true), error);
  if (!error) acceptor->set_option(tcp::acceptor::reuse_address(true), error);
  if (!error) acceptor->bind(endpoint, error);
  if (!error) acceptor->listen(asio::socket_base::max_listen_connections, error);
  if (error) {
    throw ProtocolError(address + " port " + std::to_string(at) + ": cannot listen there (" + error.message() +
                        "). Give another --port");
  }
  acceptors.push_back(std::move(acceptor));
}

void PageServer::Impl::accept(tcp::acceptor& acceptor) {
  acceptor.async_accept([this, &acceptor](const error_code& error, tcp::socket socket) {
    if (error == asio::error::operation_aborted) return;
    if (error) {  // no file descriptors left: try again when some may be free
      const auto retry = std::make_shared<asio::steady_timer>(context, std::chrono::milliseconds(100));
      retry->async_wait([this, &acceptor, retry](const error_code& stopped) {
        if (!stopped) accept(acceptor);
      });
      return;
    }
    if (connections < most_connections) serve_http(std::move(socket));
    accept(acceptor);
  });
}

PageServer::PageServer(Settings settings) : impl_(std::make_unique<Impl>(std::move(settings))) {
  Impl& s = *impl_;
  s.listen("127.0.0.1", s.settings.port);
  s.port = s.acceptors.front()->local_endpoint().port();
  try {
    s.listen("::1", s.port);
  } catch (const ProtocolError&) {  // a computer without IPv6; the URL's name leads to the other
  }
  if (!s.settings.listen.empty()) {
    error_code error;
    if (asio::ip::make_address(s.settings.listen, error).is_unspecified() && !error) {
      throw ProtocolError("--listen " + s.settings.listen + ": give one address of this computer, not all of them");
    }
    if (s.settings.listen != "127.0.0.1" && s.settings.listen != "::1") s.listen(s.settings.listen, s.port);
  }
  for (const auto& acceptor : s.acceptors) s.accept(*acceptor);
}

PageServer::~PageServer() {
  impl_->work.stop();
  close_pages(*impl_);
  impl_->stops.join();
}

std::uint16_t PageServer::port() const noexcept { return impl_->port; }

void PageServer::run() {
  impl_->signals.add(SIGINT);
  impl_->signals.add(SIGTERM);
  impl_->signals.async_wait([this](const error_code& error, int) {
    if (!error) impl_->context.stop();
  });
  if (const WorkMethod* first = impl_->work.find("work"); first != nullptr && impl_->settings.files) {
    impl_->work.submit(0, *first, nullptr, nlohmann::json::object());  // the files are read while the browser starts
  }
  impl_->context.run();
}

void PageServer::stop() { impl_->context.stop(); }

}  // namespace emtb
