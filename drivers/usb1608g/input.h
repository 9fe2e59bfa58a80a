#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "drivers/clock_report.h"
#include "drivers/doorbell.h"
#include "drivers/handover.h"
#include "drivers/sample_clock.h"
#include "drivers/usb1608g/card.h"
#include "drivers/usb1608g/scan_decoder.h"
#include "hal/clock.h"
#include "hal/input_device.h"

namespace emtb::usb1608g {

/// A signal on one of the card's inputs.
struct InputChannel {
  Signal signal{};
  Slot slot;
  double scale = 1;   ///< reading = scale * volts + offset, SI
  double offset = 0;  ///< SI
};

struct InputSettings {
  CardSettings card;
  std::vector<InputChannel> channels;  ///< 1 to 16, in the order of the scan
  double rate = 1000;                  ///< [Hz] scans that are asked for
  double latency = 0.002;              ///< [s] that samples may wait in the card to come together
  Pacer pacer = Pacer::scan;
  int start_length = 15;  ///< [bytes] of the request that starts a scan, 14 or 15
};

/// The inputs of a card, scanned all the time by its own clock, in a thread of its own.
///
/// A reading bears the time at which the card's clock says it was taken (SampleClock); a scan that had to be begun anew
/// leaves a gap. A buffer that overran is Fault::samples_lost; a scan that stops, stalls or comes in pieces of scans is
/// Fault::scan_broken; a card that is unplugged or loses its FPGA image is Fault::device_lost; an input at an end of
/// its range is Fault::over_range. Each stands until a scan is whole again; what was unplugged is opened as soon as it
/// is back. Samples of a broken scan are never spliced to the next.
class Input final : public InputDevice {
 public:
  /// Opens the card, gives it its FPGA image and reads each channel once.
  /// @param clock whose time the readings bear
  /// @throws DeviceError where the card is absent, in use, without image or calibration, or does not answer
  Input(std::string name, std::shared_ptr<Clock> clock, InputSettings settings);
  Input(const Input&) = delete;
  Input& operator=(const Input&) = delete;
  ~Input() override;

  std::span<const Channel> channels() const noexcept override { return descriptions_; }
  void start() override;  ///< the scan begins with the first
  Readings read(std::span<Reading> out) noexcept override { return handover_.take(out); }
  std::optional<ClockEstimate> own_clock() const noexcept override { return clock_report_.load(); }

 private:
  std::unique_ptr<Link> open();
  void run(std::unique_ptr<Link> link) noexcept;
  void scan(Link& link);
  void deliver(std::span<const std::uint16_t> codes, double time) noexcept;
  /// Of a scan from which nothing comes. @return why, or none where it is well after all
  Fault diagnose(Link& link) const;

  std::string name_;
  std::shared_ptr<Clock> clock_;
  InputSettings settings_;
  std::uint32_t pacer_period_;
  double period_;  ///< [s] between scans, as the card makes them
  Calibration calibration_;
  std::vector<Channel> descriptions_;
  Handover handover_;
  ClockReport clock_report_;
  MonotonicClock machine_;
  Doorbell bell_;
  std::atomic<bool> quit_ = false;
  std::atomic<bool> wanted_ = false;  ///< the scan
  std::thread thread_;
};

}  // namespace emtb::usb1608g
