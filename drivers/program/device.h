#pragma once

#include <atomic>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/doorbell.h"
#include "drivers/handover.h"
#include "drivers/program/child.h"
#include "drivers/program/line_feed.h"
#include "drivers/program/message.h"
#include "drivers/settings.h"
#include "drivers/target.h"
#include "hal/analog_output.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::program {

struct ProgramChannel {
  Signal signal{};
  Scaling scaling;
  double period = 0.1;  ///< [s] between readings
  double window = 0;    ///< [s] that a reading averages
  double latency = 0;   ///< [s] from the end of the window until the line comes
};

struct ProgramSettings {
  ChildSettings child;
  std::vector<ProgramChannel> channels;
  double start_up = 5;            ///< [s] until it must have said hello
  double silence = 1;             ///< [s] without a line that means something, after which it counts as lost
  std::optional<Limits> moves{};  ///< [V] it is the reference's output, within these
};

/// A device that is a program: lines on its stdin and stdout (docs/wiring/program.md), read in a thread of its own.
///
/// A program that ends, falls silent, floods us or does not take its lines is Fault::device_lost; it is killed, and
/// started again, until it measures again. What is no line of the protocol is dropped; much of it within a second is
/// Fault::scan_broken. What the program itself reports stands until its next reading. An output that does not say what
/// it was told within `follow`, or that we left alone for longer than its watchdog bears, is Fault::output_failed,
/// until make_safe().
class Device {
 public:
  static constexpr double alive = 0.05;    ///< [s] between two `set` at the latest
  static constexpr double watchdog = 0.2;  ///< [s] without one, after which the program makes itself safe
  static constexpr double follow = 0.3;    ///< [s] until the output must say what it was told

  /// Starts it and waits until it has said hello, and, where it moves, that its output is safe.
  /// @throws DeviceError where it does not, with the last that it wrote to its stderr
  Device(std::string name, std::shared_ptr<Clock> clock, ProgramSettings settings);
  ~Device();
  Device(const Device&) = delete;
  Device& operator=(const Device&) = delete;

  std::span<const Channel> channels() const noexcept { return descriptions_; }
  const Limits& limits() const noexcept { return target_.limits(); }
  void start() noexcept { handover_.restart(); }
  Readings read(std::span<Reading> out) noexcept { return handover_.take(out); }
  Fault set(double volts) noexcept;
  Fault make_safe() noexcept;
  pid_t pid() const noexcept { return pid_; }  ///< of its process; 0: there is none

 private:
  struct Talk;  ///< with one process, from its start to its end
  struct Farewell;

  void run() noexcept;
  void talk(Talk& talk);
  void hear(Talk& talk, const LineFeed::Line& line);
  bool deliver(Talk& talk, const Report& report);
  void follow_output(Talk& talk, double volts);
  void look_after(Talk& talk);
  /// Tells the output's value, where that is due. @return [s] until it is next
  double command(Talk& talk);
  void say_farewell(Talk& talk) noexcept;
  void ready(Talk& talk);
  void give_up() noexcept;
  [[noreturn]] void lost(Talk& talk, const std::string& why);

  std::string name_;
  std::shared_ptr<Clock> clock_;
  ProgramSettings settings_;
  std::vector<Channel> descriptions_;
  Handover handover_;
  MonotonicClock machine_;

  std::atomic<Fault> output_ = Fault::output_failed;
  std::atomic<bool> dropped_ = false;  ///< the output did not follow, until make_safe()
  std::atomic<pid_t> pid_ = 0;
  std::atomic<bool> quit_ = false;
  Doorbell bell_;
  Target target_;
  std::promise<std::string> opened_;  ///< why not; empty: it is
  bool waited_for_ = true;            ///< the constructor waits
  double complained_ = -1e9;          ///< [s] of the last line on our own stderr
  std::thread thread_;                ///< last: it uses all of the above
};

}  // namespace emtb::program
