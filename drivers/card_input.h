#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "drivers/clock_report.h"
#include "drivers/doorbell.h"
#include "drivers/handover.h"
#include "drivers/sample_clock.h"
#include "drivers/scan_assembler.h"
#include "hal/clock.h"
#include "hal/error.h"
#include "hal/input_device.h"

namespace emtb {

/// A scan has to begin anew.
struct ScanBroken {
  Fault fault;
};

/// A scan under way: makes scans of a card's bytes, gives each the time at which the card's clock says it was taken,
/// and hands its readings over. For the card's thread.
class Scan {
 public:
  /// @param channels in the order of the scan @param width [bytes] of a sample @param report of the card's clock
  Scan(std::span<const Channel> channels, std::size_t width, Handover& handover, const Clock& clock,
       ClockReport& report, const std::atomic<bool>& quit)
      : channels_(channels),
        handover_(handover),
        clock_(clock),
        report_(report),
        quit_(quit),
        assembler_(channels.size(), width),
        samples_(channels.front().period) {}

  bool wanted() const noexcept { return !quit_; }

  /// The card says that it has begun.
  void began() noexcept { samples_.arrived(0, clock_.now()); }

  /// Bytes have come. @param volts_of (k, code): [V] of channel k; nothing: at an end of its range, where the voltage
  /// may be anything beyond
  template <class VoltsOf>
  void take(std::span<const std::uint8_t> bytes, VoltsOf volts_of) {
    const std::uint64_t complete = scans_ + assembler_.scans_in(bytes.size());
    if (complete > scans_) samples_.arrived(complete - 1, clock_.now());
    report_.store(samples_.estimate());
    assembler_.feed(bytes, [&](std::span<const std::uint32_t> codes) {
      const double time = samples_.time_of(scans_++);
      bool clipped = false;
      for (std::size_t k = 0; k < codes.size(); ++k) {
        const auto volts = volts_of(k, codes[k]);
        clipped = clipped || !volts;
        const Conversion& conversion = channels_[k].conversion;
        if (volts) handover_.deliver(channels_[k].signal, time, conversion.scale * *volts + conversion.offset);
      }
      if (clipped) {
        handover_.raise(Fault::over_range);
      } else {
        handover_.clear();
      }
    });
  }

 private:
  std::span<const Channel> channels_;
  Handover& handover_;
  const Clock& clock_;
  ClockReport& report_;
  const std::atomic<bool>& quit_;
  ScanAssembler assembler_;
  SampleClock samples_;
  std::uint64_t scans_ = 0;
};

/// The inputs of a card that scans by its own clock, as CardInput drives them: one call at a time.
class ScannedInputs {
 public:
  virtual ~ScannedInputs() = default;

  /// Finds the card, and makes ready for a scan. Again after it was lost. @throws DeviceError
  virtual void open() = 0;
  virtual void close() noexcept = 0;
  /// In the order of the scan, with the scan's period, and volts for raw; once it is open. @param name of the device
  virtual std::vector<Channel> describe(const std::string& name) const = 0;
  virtual std::size_t width() const noexcept { return sizeof(std::uint16_t); }  ///< [bytes] of a sample

  /// Scans for as long as scan.wanted(). @throws ScanBroken, or DeviceError where the card has gone
  virtual void run(Scan& scan) = 0;
};

/// The inputs of a card, scanned all the time by its own clock, in a thread of its own.
///
/// A reading bears the time at which the card's clock says it was taken (SampleClock); a scan that had to be begun anew
/// leaves a gap. A buffer that overran is Fault::samples_lost; a scan that stops, falls silent or comes in pieces is
/// Fault::scan_broken; a card that has gone is Fault::device_lost; an input at an end of its range is
/// Fault::over_range. Each stands until a scan is whole again; what has gone is opened as soon as it is back. Samples
/// of a broken scan are never spliced to the next.
class CardInput final : public InputDevice {
 public:
  /// Opens the card.
  /// @param clock whose time the readings bear
  /// @throws DeviceError where the card is absent, in use, or cannot do what is asked of it
  CardInput(const std::string& name, std::shared_ptr<Clock> clock, std::unique_ptr<ScannedInputs> card);
  CardInput(const CardInput&) = delete;
  CardInput& operator=(const CardInput&) = delete;
  ~CardInput() override;

  std::span<const Channel> channels() const noexcept override { return descriptions_; }
  void start() override;  ///< the scan begins with the first
  Readings read(std::span<Reading> out) noexcept override { return handover_.take(out); }
  std::optional<ClockEstimate> own_clock() const noexcept override { return clock_report_.load(); }

 private:
  void run() noexcept;

  std::shared_ptr<Clock> clock_;
  std::unique_ptr<ScannedInputs> card_;
  std::vector<Channel> descriptions_;
  Handover handover_;
  ClockReport clock_report_;
  Doorbell bell_;
  std::atomic<bool> quit_ = false;
  std::atomic<bool> wanted_ = false;  ///< the scan
  std::thread thread_;
};

}  // namespace emtb
