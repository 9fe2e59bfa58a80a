#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "drivers/clock_report.h"
#include "drivers/sample_clock.h"
#include "drivers/simulated/daq.h"
#include "drivers/simulated/world.h"
#include "experiment/splitmix64.h"
#include "hal/input_device.h"

namespace emtb::simulated {

/// The clock of a card that scans by itself, and how its samples come to us.
struct CardClock {
  double ppm = 0;        ///< by which it is fast
  double block = 0.005;  ///< [s] of samples that come together
  double jitter = 5e-4;  ///< [s] mean of the delay of a block, which is exponential: many are quick, few are late
};

/// A card with a clock of its own: it scans its channels at the nominal rate as that clock counts, and delivers blocks
/// that come late by a varying delay. The readings' times are SampleClock's, as with real cards.
class ScanningDaq final : public InputDevice, private Observer {
 public:
  /// @param period [s] between scans, as the card's clock counts
  /// @throws ConfigError as Converters
  ScanningDaq(const std::string& name, std::shared_ptr<World> world, std::vector<DaqChannel> channels, double period,
              const CardClock& clock);
  ScanningDaq(const ScanningDaq&) = delete;
  ScanningDaq& operator=(const ScanningDaq&) = delete;
  ~ScanningDaq() override;

  std::span<const Channel> channels() const noexcept override { return converters_.descriptions(); }
  void start() override;
  Readings read(std::span<Reading> out) noexcept override;
  std::optional<ClockEstimate> own_clock() const noexcept override { return report_.load(); }

 private:
  void begin(double t, const Plant& plant) noexcept override;
  double due() const noexcept override;
  void look(const Plant& plant) noexcept override;
  double arrival_of_next_block() noexcept;
  std::span<Reading> stored(std::uint64_t scan) noexcept;

  std::shared_ptr<World> world_;
  Converters converters_;
  double period_;        ///< [s] as the card counts
  double true_period_;   ///< [s]
  double jitter_;        ///< [s]
  std::uint64_t block_;  ///< scans in a block
  std::string source_;   ///< of the delays' randomness
  std::uint64_t recordings_ = 0;
  SplitMix64 random_{0};

  bool running_ = false;
  double origin_ = 0;          ///< [s] on the clock: scan 0
  std::uint64_t scans_ = 0;    ///< taken so far
  std::uint64_t arrived_ = 0;  ///< of them with us
  std::uint64_t handed_ = 0;   ///< and handed over, whole
  std::size_t channel_ = 0;    ///< of scan `handed_`, the next to hand over
  double time_ = 0;            ///< [s] of scan `handed_`, where channel_ > 0
  double arrival_ = 0;         ///< [s] on the clock, of the next block
  std::uint64_t capacity_;     ///< scans that are kept; the oldest are lost when nobody reads for longer
  std::vector<Reading> buffer_;
  SampleClock samples_;
  ClockReport report_;
};

}  // namespace emtb::simulated
