#pragma once

#include <cstdint>
#include <memory>

#include "drivers/replay/play_clock.h"
#include "hal/input_device.h"
#include "session/session.h"

namespace emtb::replay {

/// One recorded signal as a device: each reading arrives at its time, with its value, and where there is none, none
/// arrives.
///
/// Before and after the run the value that was read last (at first: the first) is read again at every call.
class Player final : public InputDevice {
 public:
  /// @param series with at least one reading
  Player(std::shared_ptr<PlayClock> clock, Signal signal, Series series);

  std::span<const Channel> channels() const noexcept override { return {&description_, 1}; }
  void start() override;
  Readings read(std::span<Reading> out) noexcept override;

 private:
  std::shared_ptr<PlayClock> clock_;
  Series series_;
  Channel description_;
  std::size_t next_ = 0;
  std::uint64_t sequence_ = 0;
  double value_;  // read last
};

}  // namespace emtb::replay
