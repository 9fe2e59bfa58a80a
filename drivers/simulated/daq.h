#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/simulated/noise.h"
#include "drivers/simulated/world.h"
#include "hal/input_device.h"

namespace emtb::simulated {

/// One input of the simulated card: gain and offset of the sensor, its noise, then the converter.
struct DaqChannel {
  Signal signal{};
  double low = -10;        ///< [SI] what the converter's lowest and highest code stand for
  double high = 10;        ///< [SI]
  int bits = 12;           ///< of the converter; 0: no steps, no limits
  double noise = 0;        ///< [SI] sigma of a reading
  double correlation = 0;  ///< of the noise from reading to reading, 0 <= correlation < 1
  double gain = 1;         ///< reading = gain * truth + offset: a sensor that is not calibrated
  double offset = 0;       ///< [SI]

  /// What somebody found when the sensor was calibrated; without it, `low` and `high` are believed.
  struct Line {
    double scale;  ///< [SI per V] of the card, whose ends are at -10 and 10 V
    double zero;   ///< [SI] at 0 V
  };
  std::optional<Line> calibrated{};

  Line line() const noexcept { return calibrated.value_or(nominal()); }
  Line nominal() const noexcept { return {.scale = (high - low) / 20, .zero = (high + low) / 2}; }
  /// A reading, of what the converter's steps stand for as it was built.
  double reading(double quantised) const noexcept {
    return calibrated ? calibrated->scale * (quantised - nominal().zero) / nominal().scale + calibrated->zero
                      : quantised;
  }
  double lsb() const noexcept { return bits > 0 ? (high - low) / static_cast<double>(1LL << bits) : 0; }
};

/// What the channel's converter makes of a value: clipped to the range, on its steps; zero is a step of a range that is
/// even about it.
double quantise(const DaqChannel& channel, double value) noexcept;

/// The channels of a simulated card, whoever decides when they are read.
class Converters {
 public:
  /// @param period [s] between readings, for the description only
  /// @throws ConfigError for a signal that the plant does not have (it has u_ref, e_a, i_a, omega, theta, torque)
  Converters(const std::string& name, std::uint64_t seed, std::vector<DaqChannel> channels, double period);

  std::span<const Channel> descriptions() const noexcept { return descriptions_; }
  std::size_t size() const noexcept { return settings_.size(); }
  void start();  ///< another recording: with noise of its own

  /// One reading of each channel of a world that is being looked at. @param out as long as size()
  void read(const World& world, const Plant& plant, double t, std::uint64_t sequence, std::span<Reading> out) noexcept;

 private:
  std::uint64_t seed_;
  std::vector<DaqChannel> settings_;
  std::vector<Channel> descriptions_;
  std::vector<Noise> noise_;
  std::uint64_t recordings_ = 0;
};

/// A card that is read at every tick: one reading of each channel a call of read(), stamped with the clock's time.
class Daq final : public InputDevice {
 public:
  /// @param period [s] of the loop that reads it, for the description only
  /// @throws ConfigError as Converters
  Daq(const std::string& name, std::shared_ptr<World> world, std::vector<DaqChannel> channels, double period);

  std::span<const Channel> channels() const noexcept override { return converters_.descriptions(); }
  void start() override;
  Readings read(std::span<Reading> out) noexcept override;

 private:
  void sample() noexcept;

  std::shared_ptr<World> world_;
  Converters converters_;
  std::vector<Reading> sample_;
  std::size_t next_ = 0;  ///< which reading of the sample the caller has not got yet; all: the sample is used up
  std::uint64_t sequence_ = 0;
};

/// The plant has this signal.
bool measurable(Signal signal) noexcept;

}  // namespace emtb::simulated
