#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>

#include "hal/clock.h"

namespace emtb::simulated {

/// A clock that runs faster than time does, so that a simulated bench need not be waited for.
///
/// pace 1 is real time, N is N times as fast. At pace 0 time stands still but for sleep_until(), which steps it: as
/// fast as the machine can, without any sleep. Then only one thread, the loop, may call sleep_until(): it makes the
/// time of all. now() neither locks nor sleeps, and never runs backwards, whatever the pace is set to.
class PacedClock final : public Clock {
 public:
  static constexpr double as_fast_as_possible = 0;

  explicit PacedClock(double pace);

  double now() const noexcept override;
  void sleep_until(double t) noexcept override;

  /// Time goes on from where it is. From any thread: the loop may idle at pace 1 between two experiments that run fast.
  /// @param pace 0 or more; anything else is taken as 1
  void set_pace(double pace) noexcept;
  double pace() const noexcept;

 private:
  /// running = base + pace * (machine - origin)
  struct Course {
    double base = 0;    ///< [s] of this clock
    double origin = 0;  ///< [s] of the machine's clock
    double pace = 1;
    double machine = 0;  ///< [s] the machine's time at which this course was the valid one
    double running() const noexcept { return base + pace * (machine - origin); }
  };
  Course course() const noexcept;

  MonotonicClock machine_;
  std::mutex writer_;                       ///< one set_pace() at a time; readers go by the version instead
  std::atomic<std::uint64_t> version_ = 0;  ///< odd while the course is being changed
  std::atomic<double> base_;
  std::atomic<double> origin_;
  std::atomic<double> pace_;
  std::atomic<double> stepped_;  ///< [s] the least that now() may say: where pace 0 has stepped to
};

}  // namespace emtb::simulated
