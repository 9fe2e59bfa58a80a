#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>

#include "drivers/doorbell.h"
#include "hal/analog_output.h"

namespace emtb {

/// What an output shall be at: told by the loop, made so by the device's thread, whose bell rings when it changes.
class Target {
 public:
  /// Starts safe. @param bell outlives this
  Target(const Limits& limits, const Doorbell& bell) noexcept : limits_(limits), bell_(bell), volts_(limits.safe) {}

  /// @param volts clamped to the limits; no number: the target is the safe value
  /// @return false for what is no number
  bool set(double volts) noexcept {
    if (!std::isfinite(volts)) {
      make_safe();
      return false;
    }
    const double within = std::clamp(volts, limits_.min, limits_.max);
    if (volts_.exchange(within) != within) bell_.ring();
    return true;
  }
  /// Rings in any case.
  void make_safe() noexcept {
    volts_ = limits_.safe;
    bell_.ring();
  }
  double volts() const noexcept { return volts_; }
  const Limits& limits() const noexcept { return limits_; }

 private:
  Limits limits_;
  const Doorbell& bell_;
  std::atomic<double> volts_;  ///< [V] within the limits
};

}  // namespace emtb
