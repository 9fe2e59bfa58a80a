#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace emtb::serial_meter {

enum class Parity { none, even, odd };

/// How a line is set, as one would write it: `2400 8N1`, and what DTR and RTS are at. Opto couplers draw their power
/// from these two: the wrong way round, the meter is silent.
struct LineSettings {
  int baud = 9600;  ///< 600 to 115200, the usual steps
  int data_bits = 8;
  Parity parity = Parity::none;
  int stop_bits = 1;
  bool dtr = true;
  bool rts = true;

  /// [s] that so many bytes take: each has a start bit, too.
  double wire_time(std::size_t bytes) const noexcept {
    const int bits = 1 + data_bits + (parity == Parity::none ? 0 : 1) + stop_bits;
    return static_cast<double>(bits) * static_cast<double>(bytes) / baud;
  }
};

/// Reads `9600 7E2` over what is there already; DTR and RTS stay. @return nothing where it is no such text
std::optional<LineSettings> read_line(std::string_view text, LineSettings settings);

/// A serial port, ours alone while it is open.
///
/// All calls are for one thread, and only wait() waits. A port that vanishes (an adapter is pulled) makes the next call
/// throw.
class SerialPort {
 public:
  /// @throws DeviceError where the port is absent, in use, not a serial port, or cannot be set like that
  SerialPort(const std::string& path, const LineSettings& settings);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Sends all of it. @throws DeviceError where the port has gone or takes nothing for a second
  void write(std::string_view bytes);

  /// Waits until there is something to read, or until another descriptor (a wish to end) has something.
  /// @param seconds at most
  void wait(double seconds, int other) const;

  /// What has arrived; empty: nothing. @throws DeviceError where the port has gone
  std::string_view read(std::span<char> buffer);

  /// Forgets what has arrived.
  void flush() noexcept;

 private:
  void set(const LineSettings& settings);

  std::string path_;
  int file_ = -1;
};

}  // namespace emtb::serial_meter
