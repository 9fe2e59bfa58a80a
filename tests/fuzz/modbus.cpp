#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cmath>

#include "drivers/modbus_meter/link.h"
#include "drivers/modbus_meter/value.h"
#include "hal/error.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

/// A meter on loopback that says the bytes to whoever comes, whatever it is asked, and hangs up.
class Babbler {
 public:
  Babbler() : listener_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof address;
    auto* generic = reinterpret_cast<sockaddr*>(&address);
    must(
        bind(listener_, generic, size) == 0 && listen(listener_, 1) == 0 && getsockname(listener_, generic, &size) == 0,
        "loopback can be had");
    port_ = ntohs(address.sin_port);
  }
  int port() const { return port_; }

  /// To the connection that waits. @return its descriptor, for hang_up()
  int say(std::string_view bytes) const {
    const int peer = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
    must(peer >= 0, "somebody has come");
    if (!bytes.empty()) must(send(peer, bytes.data(), bytes.size(), MSG_NOSIGNAL) > 0, "it can be said");
    shutdown(peer, SHUT_WR);
    return peer;
  }
  static void hang_up(int peer) {
    const linger at_once{.l_onoff = 1, .l_linger = 0};  // without a port that rests a minute
    setsockopt(peer, SOL_SOCKET, SO_LINGER, &at_once, sizeof at_once);
    close(peer);
  }

 private:
  int listener_;
  int port_ = 0;
};

}  // namespace

/// Two answers of a meter, and the number in them. libmodbus reads the frames; the Link makes an outcome of each.
void modbus(std::string_view bytes) {
  using namespace emtb::modbus_meter;
  static const Babbler meter;
  Link link(TcpAddress{.host = "127.0.0.1", .port = meter.port()}, 255, 1);
  const int peer = meter.say(bytes);
  constexpr std::array types{Type::u32, Type::s32, Type::f32};
  const auto order = order_named(bytes.size() % 2 == 0 ? "ABCD" : "DCBA");
  for (const int function : {4, 3}) {
    std::array<std::uint16_t, 2> words{};
    const Outcome outcome = link.read(function, 0, words);
    must(outcome == Outcome::ok || !link.why().empty(), "what fails says why");
    if (outcome != Outcome::ok) continue;
    for (const Type type : types) must(type == Type::f32 || std::isfinite(decode(words, type, *order)), "a number");
  }
  Babbler::hang_up(peer);
}

}  // namespace emtb::fuzz
