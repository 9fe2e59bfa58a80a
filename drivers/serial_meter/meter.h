#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>

#include "drivers/handover.h"
#include "drivers/serial_meter/conversation.h"
#include "drivers/serial_meter/models.h"
#include "drivers/wake.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::serial_meter {

struct MeterSettings {
  std::string port;  ///< `/dev/serial/by-id/...`
  std::shared_ptr<const Model> model;
  LineSettings line;
  Signal signal = Signal::i_a;
  Function function{};
  double scale = 1;      ///< of the signal's unit in the function's: reading = scale * measurement + offset
  double offset = 0;     ///< in the signal's unit
  double file_unit = 1;  ///< SI of one of the unit in which the bench file gives scale and offset
  double file_zero = 0;  ///< SI of its zero
  double range = 0;      ///< full scale in the function's unit; 0: the meter chooses
  double reach = 0;      ///< the largest that it shows, in the signal's unit, without the offset; 0: unknown
  double digit = 0;      ///< in the signal's unit; 0: unknown
  double period = 0.4;   ///< [s] between readings
  double window = 0.4;   ///< [s] that a reading averages
  double latency = 0;    ///< [s] from the end of the window until the meter begins to send
  double timeout = 1.5;  ///< [s] without an answer, after which the meter is asked anew
};

/// A multimeter on a serial line, in a thread of its own.
///
/// A reading bears the end of its window: when its last byte came, less its time on the wire and the latency. Overload
/// is Fault::over_range; a meter that measures something else, or holds its display, is Fault::wrong_function; a port
/// that vanishes is Fault::device_lost. Each stands until a good reading comes; a lost port is opened again as soon as
/// it is back. Noise and silence give no reading: what is missing for too long, the loop notices.
class Meter final : public InputDevice {
 public:
  /// @param clock whose time the readings bear
  /// @throws DeviceError where the port cannot be opened
  Meter(const std::string& name, std::shared_ptr<Clock> clock, const MeterSettings& settings);
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;
  ~Meter() override;

  std::span<const Channel> channels() const noexcept override { return {&description_, 1}; }
  void start() override { handover_.restart(); }
  Readings read(std::span<Reading> out) noexcept override { return handover_.take(out); }

 private:
  struct Answer {
    Measurement measurement;
    double time;  ///< [s] end of its window, on the loop's clock
  };

  void run(std::unique_ptr<SerialPort> port) noexcept;
  void listen(Conversation& talk);
  void poll(Conversation& talk);
  bool prompted(Conversation& talk);
  bool set_up(Conversation& talk);
  std::optional<Answer> ask(Conversation& talk);
  double end_of_window(const Message& message) const noexcept;
  void judge(const Measurement& measurement, double time) noexcept;

  std::shared_ptr<Clock> clock_;
  MeterSettings settings_;
  const Protocol& protocol_;
  Channel description_;
  Handover handover_;
  MonotonicClock machine_;
  Wake quit_;
  std::thread thread_;
};

}  // namespace emtb::serial_meter
