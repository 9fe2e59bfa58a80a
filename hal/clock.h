#pragma once

namespace emtb {

/// Time as the loop and the devices see it.
///
/// Seconds from an arbitrary origin, never running backwards. Thread-safe.
class Clock {
 public:
  virtual ~Clock() = default;

  /// [s]
  virtual double now() const noexcept = 0;

  /// Returns once now() >= t. A time in the past returns at once.
  virtual void sleep_until(double t) noexcept = 0;
};

/// The machine's CLOCK_MONOTONIC, with absolute sleeps (no drift, whatever a cycle takes).
class MonotonicClock final : public Clock {
 public:
  double now() const noexcept override;
  void sleep_until(double t) noexcept override;
};

}  // namespace emtb
