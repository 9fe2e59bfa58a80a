#pragma once

#include <algorithm>
#include <cstdint>
#include <limits>

namespace emtb {

/// The loop's time of samples that a device takes by its own clock and delivers in packets, late by a varying delay.
///
/// Sample n is taken at t_0 + n·T. A packet never arrives before its last sample was taken, so the earliest arrival
/// tells t_0 best: t_0 = min(arrival - n·T). Clocks differ, crystals by some 50 ppm, so the minimum may rise by a part
/// of the time that passes. Times only grow, by half a period at least.
class SampleClock {
 public:
  static constexpr double crystal = 100e-6;   ///< more than two crystals differ
  static constexpr double resonator = 10e-3;  ///< ceramic, as cheap boards have

  /// @param period [s] between samples @param drift by how much of the time the two clocks may run apart
  explicit SampleClock(double period, double drift = crystal) noexcept : period_(period), drift_(drift) {}

  /// Samples up to number n (from 0) have arrived. The device's word that it has begun counts as sample 0.
  /// @param arrival [s] on the loop's clock
  void arrived(std::uint64_t n, double arrival) noexcept {
    const double elapsed = static_cast<double>(n) * period_;
    origin_ += drift_ * std::max(0.0, elapsed - elapsed_);
    origin_ = std::min(origin_, arrival - elapsed);
    elapsed_ = std::max(elapsed_, elapsed);
  }
  /// [s] on the loop's clock. Ask for each sample once, in order.
  double time_of(std::uint64_t n) noexcept {
    const double truth = origin_ + static_cast<double>(n) * period_;
    last_ = std::max(truth, last_ + period_ / 2);
    return last_;
  }

 private:
  double period_;
  double drift_;
  double origin_ = std::numeric_limits<double>::infinity();  // [s] of sample 0
  double elapsed_ = 0;                                       // [s]
  double last_ = -std::numeric_limits<double>::infinity();
};

}  // namespace emtb
