#pragma once

#include <atomic>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include "drivers/clock_report.h"
#include "drivers/doorbell.h"
#include "drivers/handover.h"
#include "drivers/line_settings.h"
#include "drivers/sample_clock.h"
#include "drivers/serial_daq/frame.h"
#include "drivers/serial_daq/message.h"
#include "drivers/serial_port.h"
#include "drivers/target.h"
#include "hal/analog_output.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::serial_daq {

/// An analog input: value = scale * share + offset, where share is 0 to 1 of the input's full range.
struct Analog {
  std::size_t input = 0;
  double scale = 1;   ///< SI at full range
  double offset = 0;  ///< SI
};

/// Angle or speed from the encoder's counts: the speed is the mean since the sample before.
struct Encoder {
  double per_count = 0;  ///< [rad] of the shaft that is meant; negative: the leads are swapped
};

/// The voltage that a PWM makes: duty times the bus.
struct Pwm {};

struct BoardChannel {
  Signal signal{};
  std::variant<Analog, Encoder, Pwm> source;
};

struct BoardSettings {
  std::string port;
  LineSettings line{.baud = 115200};
  double rate = 200;    ///< [Hz] samples
  double start_up = 5;  ///< [s] until the board must have answered: opening the port restarts many
  std::vector<BoardChannel> channels;
  std::variant<double, Analog> bus = 12.0;  ///< [V] of the H bridge's supply, or where it is measured
  Limits limits;                            ///< [V] of the reference
  double full_duty = 6;                     ///< [V] of the reference at which the PWM is always on
};

/// A microcontroller on a serial line that samples, counts and makes a PWM, in a thread of its own.
///
/// The board repeats nothing and waits for nothing: a sample whose frame is broken is dropped, and is a gap. A board
/// that falls silent or whose port vanishes is Fault::device_lost, one that starts anew, or of whose frames many are
/// broken, is Fault::scan_broken; each stands until samples come again. The board drops its PWM where we are silent
/// (its watchdog); where it did so, until make_safe(), or cannot be reached, the output is Fault::output_failed.
class Board {
 public:
  /// Opens the port and waits for the board. Its PWM is told to be safe.
  /// @throws DeviceError where the port cannot be opened, or nobody there speaks the protocol
  Board(std::string name, std::shared_ptr<Clock> clock, BoardSettings settings);
  ~Board();
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  std::span<const Channel> channels() const noexcept { return descriptions_; }
  const Limits& limits() const noexcept { return target_.limits(); }
  void start();
  Readings read(std::span<Reading> out) noexcept { return handover_.take(out); }
  Fault set(double volts) noexcept;
  Fault make_safe() noexcept;
  ClockEstimate clock() const noexcept { return clock_report_.load(); }
  std::uint64_t broken_frames() const noexcept { return broken_; }

 private:
  struct Scan {  ///< since the board was last told to sample
    explicit Scan(double period) : times(period, SampleClock::resonator) {}
    SampleClock times;
    std::uint64_t next = 0;        ///< number that is expected
    std::optional<Sample> before;  ///< the last that came
    std::int64_t turned = 0;       ///< counts since the scan began
    std::uint64_t broken = 0;      ///< frames, at the last look
    double looked = 0;             ///< [s] then
  };

  void connect();
  void run() noexcept;
  void talk();
  /// Tells the duty, where that is due. @return [s] until it is next
  double command(bool at_once);
  void hear(std::string_view bytes);
  void take(std::span<const std::uint8_t> message);
  void take(const Sample& sample);
  double value(const BoardChannel& channel, const Sample& sample, double counted) const noexcept;
  std::int16_t duty_of(double volts) const noexcept;
  void ask_for_samples();

  std::string name_;
  std::shared_ptr<Clock> clock_;
  BoardSettings settings_;
  double period_;  ///< [s]
  std::vector<Channel> descriptions_;
  Handover handover_;
  ClockReport clock_report_;
  MonotonicClock machine_;

  // Of the thread.
  std::unique_ptr<SerialPort> port_;
  FrameReader frames_;
  std::optional<Hello> hello_;
  bool sampling_ = false;
  Scan scan_;
  double heard_ = 0;  ///< [s] the last sample, or when one was asked for
  double told_ = 0;   ///< [s] the last duty
  std::int16_t told_duty_ = 0;

  std::atomic<bool> start_ = false;
  std::atomic<Fault> output_ = Fault::none;
  std::atomic<bool> dropped_ = false;  ///< the watchdog has bitten, until make_safe()
  std::atomic<std::uint64_t> broken_ = 0;
  std::atomic<bool> quit_ = false;
  Doorbell bell_;
  Target target_;
  std::thread thread_;
};

}  // namespace emtb::serial_daq
