#pragma once

#include <cmath>
#include <cstdint>

namespace emtb {

/// When a loop of fixed rate wakes: absolute deadlines, so that no cycle's length adds up to drift.
///
/// A deadline that passes while the loop is late is skipped, never made up for: catching up would run the bench too
/// fast.
class Deadline {
 public:
  /// The first deadline is one period after `start`. @param period [s] > 0
  Deadline(double start, double period) noexcept : start_(start), period_(period) {}

  /// [s] to sleep until
  double next() const noexcept { return start_ + period_ * static_cast<double>(count_); }

  /// Call on waking. @return how many whole periods were missed; the deadline after next is behind `now` no more.
  std::uint64_t woke(double now) noexcept {
    const double late = now - next();
    const auto missed = late >= period_ ? static_cast<std::uint64_t>(std::floor(late / period_)) : 0;
    count_ += 1 + missed;
    if (next() <= now) ++count_;  // rounding: `late` a hair below a whole number of periods
    return missed;
  }

  /// Begins anew after something that was allowed to take its time; nothing counts as missed.
  void restart(double now) noexcept {
    start_ = now;
    count_ = 1;
  }

 private:
  double start_;
  double period_;
  std::uint64_t count_ = 1;  // periods from start_ to the next deadline; an integer, so that nothing drifts
};

}  // namespace emtb
