#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <vector>

#include "hal/signal.h"
#include "model/simulation.h"
#include "model/step.h"

namespace emtb {

/// What the fast instruments read at one tick; NaN: nothing.
struct LiveTick {
  static constexpr double none = std::numeric_limits<double>::quiet_NaN();
  enum class Kind : std::uint8_t { next, run_start, gap };

  double t = 0;      ///< [s] from the start of the run
  double u_ref = 0;  ///< [V] from now on
  double e_a = none, i_a = none, omega = none, torque = none, temperature = none;
  double drive = none;  ///< [V] across the motor, of e_a
  double load = 0;      ///< [N m] of the torque, where that is more than noise
  double field_on = 0;  ///< [s] of a run's start: since the field was switched on
  Kind kind = Kind::next;

  /// Where the reading of a signal stands; null: a tick has none of it.
  static double LiveTick::*member_of(Signal signal);
  double at(Signal signal) const { return this->*member_of(signal); }
};

/// A slow meter's reading: the mean over a window.
struct SlowReading {
  std::size_t after = 0;      ///< the tick at which it was there
  std::size_t output = 0;     ///< place in LivePlan::outputs
  double begin = 0, end = 0;  ///< [s]
  double value = 0;
};

/// A part of the history that is forgotten as a whole.
struct LiveChapter {
  std::vector<LiveTick> ticks;
  std::vector<SlowReading> readings;
  std::vector<Machine<WideSensitive>> machines;  ///< as they were when it began; none: it begins with a run
};

/// What is kept of the readings, to be simulated once more: two chapters, the older of which is forgotten when the
/// newer one is full. Its memory is fixed after construction.
class LiveHistory {
 public:
  /// @param ticks of a full chapter. @param rate [Hz] of the ticks
  LiveHistory(std::size_t ticks, double rate);

  const std::vector<LiveChapter>& chapters() const { return chapters_; }
  LiveChapter& current() { return chapters_.back(); }

  /// The newest tick, whose readings may still come.
  void add(const LiveTick& tick);

  /// A reading of a tick that is not complete yet, into the one whose time is the nearest.
  /// @param farthest [s] from that tick. @return false: no tick is as near
  bool put(Signal signal, double t, double value, double farthest);

  /// A slow meter's; lost where there is no room.
  void put_slow(std::size_t output, double begin, double end, double value);

  /// So many ticks of the last chapter will not change any more, and what follows them is there to look ahead to.
  std::size_t complete() const;

  /// The chapter is full, and complete enough to be closed.
  bool chapter_full() const;

  /// Forgets the first chapter. @param machines as they are at the end of the last
  void begin_chapter(const std::vector<Machine<WideSensitive>>& machines);

 private:
  std::size_t capacity_;    ///< ticks of a chapter
  std::size_t late_;        ///< ticks that a reading may come late
  std::size_t look_ahead_;  ///< ticks from which the first speed is read
  std::vector<LiveChapter> chapters_;
  std::size_t restart_ = 0;  ///< tick of the last chapter at which a run or a gap's end needs that look ahead
};

}  // namespace emtb
