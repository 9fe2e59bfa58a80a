#pragma once

namespace emtb {

/// The speed that the effects of a measured load see: as it was read, whatever the motion lacks, but for what the
/// effects of the sensors say that the reading is off by. Thus the gauge bends no motion, and a late speed no load.
template <class Scalar>
class SpeedAsRead {
 public:
  /// The readings of a step, or those with which a run begins: before these the error was the same.
  void follow(const Scalar& reading, const Scalar& omega, bool begins) {
    const Scalar error = reading - omega;
    before_ = begins ? error : error_;
    error_ = error;
  }

  /// [rad/s] In the middle and at the end of the step to come, of which the error is extrapolated.
  Scalar in_middle(double measured) const { return measured - (1.5 * error_ - 0.5 * before_); }
  Scalar at_end(double measured) const { return measured - (2.0 * error_ - before_); }

 private:
  Scalar error_{}, before_{};  ///< [rad/s] of the last reading and of the one before
};

}  // namespace emtb
