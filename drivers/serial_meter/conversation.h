#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "drivers/serial_meter/measurement.h"
#include "drivers/serial_port.h"
#include "hal/clock.h"

namespace emtb::serial_meter {

/// A talk with a meter: text out, messages in, whatever noise there is between them.
///
/// Times are of the machine's clock. Each call throws DeviceError where the port has gone.
class Conversation {
 public:
  /// @param wish_to_end a descriptor; once it can be read from, nothing waits any more
  Conversation(SerialPort& port, Find find, int wish_to_end)
      : port_(port), find_(std::move(find)), wish_to_end_(wish_to_end) {}

  void say(std::string_view text) { port_.write(text); }

  /// The next message that is not noise. Its kind is `partial` where none comes in time.
  /// @param until [s]
  Message listen(double until);

  /// Forgets what was said, and what still comes until it has been quiet for a while: late answers.
  void settle(double quiet, double at_most);

 private:
  Message next();
  bool ended() const;

  SerialPort& port_;
  Find find_;
  int wish_to_end_;
  std::string received_;
  std::array<char, 256> buffer_{};
  MonotonicClock machine_;
};

}  // namespace emtb::serial_meter
