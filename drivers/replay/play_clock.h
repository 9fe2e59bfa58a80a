#pragma once

#include <atomic>
#include <cstddef>
#include <vector>

#include "hal/clock.h"

namespace emtb::replay {

/// Time as it was when a session was recorded.
///
/// While it plays, sleep_until() wakes at the recorded tick that comes next, whatever was asked for: late where that
/// one was late, and after a gap where deadlines were missed. Time zero is the run's, so that `time - start` of a
/// reading is the recorded number, bit by bit. Otherwise it is the machine's time.
///
/// rewind() makes time run backwards, the one clock that does: whoever calls it restarts the devices, as the loop does
/// before a run. rewind(), play() and sleep_until() are for the loop's thread.
class PlayClock final : public Clock {
 public:
  /// @param ticks [s] from the start of the run, increasing, the first is 0
  /// @param period [s] of the loop, for the time before the first tick
  /// @param pace times real time; infinity: as fast as it goes
  PlayClock(std::vector<double> ticks, double period, double pace);

  double now() const noexcept override;
  void sleep_until(double t) noexcept override;

  void rewind() noexcept;  ///< to one period before the first tick
  void play(bool on) noexcept;
  bool playing() const noexcept { return playing_.load(); }

  /// [s] Until when readings were taken in the tick that is on: those of a card are some microseconds younger than it.
  double horizon() const noexcept;

  double end() const noexcept { return ticks_.back(); }  ///< [s] the last recorded tick

 private:
  double flowing() const noexcept;
  void restart_at(double t) noexcept;

  MonotonicClock machine_;
  const std::vector<double> ticks_;
  const double period_;
  const double pace_;
  std::size_t next_ = 0;  // tick to wake at
  std::atomic<bool> playing_ = false;
  std::atomic<double> stepped_ = 0;  // [s] now, while playing
  std::atomic<double> base_;         // [s] of this clock at origin_
  std::atomic<double> origin_;       // [s] of the machine's
};

}  // namespace emtb::replay
