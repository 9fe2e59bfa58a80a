#pragma once

#include <algorithm>
#include <cmath>

#include "tests/blind/wide/bench.h"

namespace emtb::blind::wide {

/// Somebody's loop: a proportional and integral one of speed, or a proportional one of position over a proportional one
/// of speed. Its gains follow from the motor, less where the reading is too coarse for them.
class Controller {
 public:
  explicit Controller(const WideBench& bench) : loop_(bench.loop), period_(bench.period) {
    const Machine& m = bench.machine;
    const Instrument* tacho = bench.find(Signal::omega);
    const double sigma = tacho != nullptr ? tacho->sigma() : 0.4 * bench.encoder.step / bench.period;
    tau_ = m.tau;
    gain_ = 1 / m.gain;
    most_ = m.voltage / m.gain;
    least_ = m.both_ways ? -most_ : 0;
    // 2 K makes the loop three times as fast as the motor. No more than 3 % of the voltage shall be noise.
    proportional_ = std::min(2 * m.K, 0.03 * m.voltage / std::max(sigma, 1e-12));
    const double p = proportional_ / m.K;
    stiffness_ = 0.2 * (1 + p) * (1 + p) / (p * m.tau);
  }

  /// @param target [rad/s] or [rad] @return [V] the reference, within what the driver takes
  double act(double target, double speed, double angle) {
    if (loop_ == Loop::position) {
      return std::clamp(gain_ * proportional_ * (stiffness_ * (target - angle) - speed), least_, most_);
    }
    const double error = target - speed;
    sum_ = std::clamp(sum_ + gain_ * proportional_ * error * period_ / tau_, least_, most_);
    return std::clamp(gain_ * proportional_ * error + sum_, least_, most_);
  }

 private:
  Loop loop_;
  double period_, tau_ = 1, gain_ = 1, most_ = 0, least_ = 0, proportional_ = 0, stiffness_ = 0, sum_ = 0;
};

}  // namespace emtb::blind::wide
