#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "hal/clock_estimate.h"

namespace emtb {

/// The loop's time of samples that a device takes by its own clock and delivers in packets, late by a varying delay.
///
/// Sample n is taken at x = n·T of the device's time, and at
///
///     t = x + o(x),   o(x) = o_0 + s·x
///
/// of the loop's. A packet never arrives before its last sample was taken, so all arrivals y = arrival - x lie above
/// o(x), and the earliest lie on it. Of each stretch of time the earliest arrival is kept, over the last minutes; the
/// lower convex hull of these has its slope s above the middle of the time (the line beneath all points that lies
/// closest to them: Moon, Skelly and Towsley 1999; Zhang, Liu and Xia 2002). The offset follows the earliest arrivals
/// at once: it falls to each that lies below it, and rises by the slope, and by as much more as the slope is uncertain.
/// Until the slope is known better than crystals are, it is taken as 0 and as uncertain as these.
///
/// Times only grow, by half a period at least. docs/decisions/device-clocks.md has what was measured.
class SampleClock {
 public:
  static constexpr double crystal = 100e-6;   ///< more than two crystals differ
  static constexpr double resonator = 10e-3;  ///< ceramic, as cheap boards have

  /// @param period [s] between samples @param tolerance by how much of the time the two clocks may run apart
  explicit SampleClock(double period, double tolerance = crystal) noexcept
      : period_(period), tolerance_(tolerance), leak_(tolerance) {}

  /// Samples up to number n (from 0) have arrived. The device's word that it has begun counts as sample 0.
  /// @param arrival [s] on the loop's clock
  void arrived(std::uint64_t n, double arrival) noexcept;

  /// [s] on the loop's clock. Ask for each sample once, in order.
  double time_of(std::uint64_t n) noexcept;

  ClockEstimate estimate() const noexcept;

 private:
  struct Point {
    double x = 0;  ///< [s] of the device's time since sample 0
    double y = 0;  ///< [s] arrival - x
  };

  double height(const Point& point) const noexcept { return point.y - slope_ * point.x; }
  void keep(const Point& point) noexcept;
  void make_room() noexcept;
  void fit() noexcept;

  double period_;
  double tolerance_;
  double slope_ = 0;
  double std_error_ = std::numeric_limits<double>::infinity();  // of the slope
  double leak_;                                                 // by which the offset may rise beyond the slope
  double offset_ = std::numeric_limits<double>::infinity();     // [s] o(x_)
  double x_ = 0;                                                // [s] of the newest arrival
  double known_offset_ = 0;                                     // [s] when the slope became known
  double last_ = -std::numeric_limits<double>::infinity();      // [s] handed out

  std::array<Point, 64> earliest_{};  // of each stretch, oldest first
  std::size_t count_ = 0;
  double width_ = 0.0625;  // [s] of a stretch; twice as long whenever there are too many
  double end_ = 0;         // [s] of the newest stretch
};

}  // namespace emtb
