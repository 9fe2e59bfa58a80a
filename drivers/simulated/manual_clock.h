#pragma once

#include <algorithm>

#include "hal/clock.h"

namespace emtb {

/// Time goes when a test says so.
class ManualClock final : public Clock {
 public:
  explicit ManualClock(double start = 1000) : now_(start) {}
  double now() const noexcept override { return now_; }
  void sleep_until(double t) noexcept override { now_ = std::max(now_, t); }

 private:
  double now_;
};

}  // namespace emtb
