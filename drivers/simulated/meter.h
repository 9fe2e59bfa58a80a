#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>

#include "drivers/simulated/noise.h"
#include "drivers/simulated/world.h"
#include "hal/input_device.h"

namespace emtb::simulated {

struct MeterSettings {
  double period = 0.4;        ///< [s] between readings: 2.5 Hz, as bench multimeters send over RS-232
  double window = 0.4;        ///< [s] that a reading averages, at most the period
  double resolution = 0.001;  ///< [A] last digit; 0: no steps
  double noise = 0;           ///< [A] sigma of a reading
  double offset = 0;          ///< [A] of every reading: a meter that was not zeroed
  double latency = 0;         ///< [s] from the end of the window until the reading arrives
  bool rms = false;           ///< reads the root mean square of its window instead of the mean
};

/// A multimeter in the armature circuit: each reading is the mean (or rms) of i_a over its window, stamped with the
/// window's end.
///
/// The first window opens with the first look at the plant after start().
class Meter final : public InputDevice, private Observer {
 public:
  /// @throws ConfigError where the window is longer than the period.
  Meter(std::string name, std::shared_ptr<World> world, const MeterSettings& settings);
  Meter(const Meter&) = delete;
  Meter& operator=(const Meter&) = delete;
  ~Meter() override;

  std::span<const Channel> channels() const noexcept override { return {&description_, 1}; }
  void start() override;
  Readings read(std::span<Reading> out) noexcept override;

 private:
  void begin(double t, const Plant& plant) noexcept override;
  double due() const noexcept override;
  void look(const Plant& plant) noexcept override;

  std::string name_;
  std::shared_ptr<World> world_;
  MeterSettings settings_;
  Channel description_;
  Noise noise_;
  std::uint64_t recordings_ = 0;

  bool running_ = false;
  double origin_ = 0;                 ///< [s] on the clock: the first window opened
  std::uint64_t window_ = 0;          ///< which window
  bool open_ = false;                 ///< it has begun
  double charge_ = 0;                 ///< [A s] when it began
  double squares_ = 0;                ///< [A2 s] when it began
  std::array<Reading, 16> buffer_{};  ///< 6 s of readings; the oldest are lost when nobody reads for longer
  std::uint64_t written_ = 0;
  std::uint64_t read_ = 0;
};

}  // namespace emtb::simulated
