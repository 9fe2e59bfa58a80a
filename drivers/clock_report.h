#pragma once

#include <atomic>
#include <limits>

#include "hal/clock_estimate.h"

namespace emtb {

/// A ClockEstimate for other threads, or processes, to look at: each value by itself, so good for eyes.
class ClockReport {
 public:
  void store(const ClockEstimate& estimate) noexcept {
    fast_.store(estimate.fast, std::memory_order_relaxed);
    std_error_.store(estimate.std_error, std::memory_order_relaxed);
    ahead_.store(estimate.ahead, std::memory_order_relaxed);
    over_.store(estimate.over, std::memory_order_relaxed);
  }
  ClockEstimate load() const noexcept {
    return {.fast = fast_.load(std::memory_order_relaxed),
            .std_error = std_error_.load(std::memory_order_relaxed),
            .ahead = ahead_.load(std::memory_order_relaxed),
            .over = over_.load(std::memory_order_relaxed)};
  }

 private:
  std::atomic<double> fast_ = 0;
  std::atomic<double> std_error_ = std::numeric_limits<double>::infinity();
  std::atomic<double> ahead_ = 0;
  std::atomic<double> over_ = 0;
};

}  // namespace emtb
