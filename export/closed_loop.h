#pragma once

#include "export/controller.h"

namespace emtb {

/// A step of the speed's reference with a controller on the whole model: all effects, and the driver's limits.
struct StepWishes {
  Loop loop = Loop::cascade;
  bool feed_forward = true;
  double speed = 0;     ///< [rad/s] to which it goes from rest
  double rate = 1000;   ///< [Hz]
  double duration = 0;  ///< [s]
};

/// What came of it.
struct StepAnswer {
  std::vector<double> t, omega, i_a, e_a;  ///< [s], [rad/s], [A], [V] the controller's; at each sample
  double rise = 0;                         ///< [s] from 10 to 90 % of the step; not finite: it does not get there
  double overshoot = 0;                    ///< [1] of the step
  double settled = 0;                      ///< [s] until it stays within 2 %; not finite: it does not
  double left = 0;                         ///< [rad/s] off at the end
  double largest_current = 0;              ///< [A]
  double limited = 0;                      ///< [1] share of the time in which the driver cannot do what it is told
};

/// @throws ModelError where the model is a current drive's: it closes the current loop by itself.
StepAnswer step_answer(const Model& model, const Gains& gains, const StepWishes& wishes);

}  // namespace emtb
