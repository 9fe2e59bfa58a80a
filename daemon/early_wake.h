#pragma once

#include <algorithm>

namespace emtb {

/// How long before its deadline a real-time loop asks to be woken, so that it is awake when the deadline comes.
///
/// A sleep ends late by what the machine needs to wake (10 to 60 us), and by more where other programs have filled the
/// caches in between. The margin follows that: up by a part of what a sleep was late beyond it, down slowly, so that in
/// balance about one sleep in a thousand ends later. What is left until the deadline is waited for awake. Xenomai
/// shifts its timers in the same way ("gravity").
class EarlyWake {
 public:
  /// @param period [s] of the loop, of which at most a quarter is spent awake before a deadline
  explicit EarlyWake(double period) noexcept : most_(std::min(longest, share * period)) {}

  /// [s]
  double margin() const noexcept { return margin_; }

  /// @param late [s] how much later than asked the sleep ended
  void slept(double late) noexcept {
    constexpr double up = 0.25, down = 1e-4;  // of the excess; of the margin, each time
    margin_ = late > margin_ ? std::min(most_, margin_ + up * (late - margin_)) : margin_ * (1 - down);
  }

 private:
  static constexpr double longest = 200e-6, share = 0.25;  // [s]; of a period

  double most_;
  double margin_ = 0;
};

}  // namespace emtb
