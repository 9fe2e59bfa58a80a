#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <variant>

#include "drivers/line_settings.h"

struct _modbus;  // NOLINT(bugprone-reserved-identifier): as libmodbus calls it

namespace emtb::modbus_meter {

struct TcpAddress {
  std::string host;
  int port = 502;
};

struct RtuAddress {
  std::string port;  ///< `/dev/serial/by-id/...`
  LineSettings line;
};

using Address = std::variant<TcpAddress, RtuAddress>;

/// The address as messages say it: `192.168.1.20:502`, `/dev/ttyUSB0`.
std::string name_of(const Address& address);

/// How a request went.
enum class Outcome : std::uint8_t {
  ok,
  silent,   ///< no answer in time
  garbled,  ///< an answer with a wrong checksum, number, length or function
  refused,  ///< the meter has no such function or register
  unable,   ///< the meter answers that it cannot now
  gone,     ///< the port or the connection has vanished
};

/// A connection to one Modbus meter, by libmodbus. For one thread; its calls wait for at most the timeout.
class Link {
 public:
  /// @param unit 1 to 247, on TCP 255 for the device itself
  /// @param timeout [s]
  /// @throws DeviceError where the port cannot be opened or the host does not answer
  Link(const Address& address, int unit, double timeout);

  /// Reads registers. @param function 3 (holding) or 4 (input) @param address from 0
  Outcome read(int function, int address, std::span<std::uint16_t> words) noexcept;

  /// Why the last read() failed, for a person: `Illegal data address`.
  const std::string& why() const noexcept { return why_; }

  /// Forgets what has arrived.
  void flush() noexcept;

 private:
  struct Free {
    void operator()(_modbus* context) const noexcept;
  };
  std::unique_ptr<_modbus, Free> context_;
  std::string why_;
};

}  // namespace emtb::modbus_meter
