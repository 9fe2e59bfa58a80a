#pragma once

#include <optional>
#include <vector>

#include "hal/signal.h"
#include "session/session.h"

namespace emtb {

/// Means over a short time in which the motor was connected.
struct MotionWindow {
  double voltage = 0, current = 0, speed = 0, acceleration = 0, torque = 0;  ///< SI; 0 where not measured
};

/// A run as means over windows: of ten readings or a four hundredth of the run, or those of a slow current meter.
struct MotionWindows {
  std::optional<Signal> voltage;  ///< e_a, or else u_ref
  std::optional<Signal> speed;    ///< omega, or else theta
  bool current = false, torque = false;
  bool starts_at_rest = true;
  std::vector<MotionWindow> all;
};

MotionWindows motion_windows(const Run& run);

/// Both, where they hold the same signals; what either holds, where the other is empty.
void append(MotionWindows& to, const MotionWindows& more);

}  // namespace emtb
