#pragma once

#include <span>
#include <string>
#include <string_view>

#include "drivers/line_settings.h"

namespace emtb {

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

}  // namespace emtb
