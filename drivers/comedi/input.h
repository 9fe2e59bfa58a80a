#pragma once

#include <atomic>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/clock_report.h"
#include "drivers/comedi/link.h"
#include "drivers/doorbell.h"
#include "drivers/handover.h"
#include "drivers/sample_clock.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::comedi {

/// A signal on one of the card's inputs: reading = scale · volts + offset.
struct InputChannel {
  Signal signal{};
  unsigned int channel = 0;
  Wiring wiring = Wiring::single_ended;
  Range wanted{.min = -10, .max = 10};  ///< [V] the narrowest range of the card that holds it is taken
  double scale = 1;                     ///< [the signal's unit per V]
  double offset = 0;
};

struct InputSettings {
  CardSettings card;
  std::vector<InputChannel> channels;  ///< in the order of the scan
  double rate = 1000;                  ///< [Hz] scans that are asked for
};

/// The inputs of a card, scanned all the time by its own clock (a comedi command), in a thread of its own.
///
/// A reading bears the time at which the card's clock says it was taken (SampleClock); a scan that had to be begun anew
/// leaves a gap. A buffer that overran is Fault::samples_lost; a command that ends or falls silent is
/// Fault::scan_broken; a card that has gone is Fault::device_lost; an input at an end of its range is
/// Fault::over_range. Each stands until a scan is whole again. Samples of a broken scan are never spliced to the next.
class Input final : public InputDevice {
 public:
  /// Opens the card, chooses ranges, has it check the command, and reads each channel once.
  /// @throws DeviceError where the card is absent or in use, has no such channel or range, or cannot scan at the rate
  Input(std::string name, std::shared_ptr<Clock> clock, InputSettings settings);
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;
  ~Input() override;

  std::span<const Channel> channels() const noexcept override { return descriptions_; }
  void start() override;  ///< the scan begins with the first
  Readings read(std::span<Reading> out) noexcept override { return handover_.take(out); }
  std::optional<ClockEstimate> own_clock() const noexcept override { return clock_report_.load(); }

 private:
  /// What the card is told.
  struct Plan {
    unsigned int subdevice = 0;
    std::size_t width = 2;           ///< [bytes] of a sample
    std::vector<unsigned int> list;  ///< channels, packed
    std::vector<Range> ranges;
    std::vector<Converter> converters;
    comedi_cmd command{};  ///< its list is set where it is used
    double period = 0;     ///< [s] that the card makes of it
  };

  Plan plan(const Link& link) const;
  std::vector<Channel> describe() const;
  void run(std::unique_ptr<Link> link) noexcept;
  void scan(const Link& link);
  void deliver(std::span<const lsampl_t> codes, double time) noexcept;

  std::string name_;
  std::shared_ptr<Clock> clock_;
  InputSettings settings_;
  std::unique_ptr<Link> opened_;  ///< until the thread has it
  Plan plan_;
  std::vector<Channel> descriptions_;
  Handover handover_;
  ClockReport clock_report_;
  MonotonicClock machine_;
  Doorbell bell_;
  std::atomic<bool> quit_ = false;
  std::atomic<bool> wanted_ = false;  ///< the scan
  std::thread thread_;
};

}  // namespace emtb::comedi
