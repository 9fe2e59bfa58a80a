#pragma once

#include <complex>
#include <vector>

#include "export/linear.h"

namespace emtb {

/// A PI controller: output = kp error + ki times its integral.
struct Pi {
  double kp = 0, ki = 0;
};

/// What a person asks of the loops; 0: chosen here.
struct LoopWishes {
  double speed_bandwidth = 0;    ///< [Hz]
  double current_bandwidth = 0;  ///< [Hz]
  double rate = 1000;            ///< [Hz] at which the controller computes
};

/// Controllers for a motor that a voltage drives.
///
///     cascade:  i* = PI_speed(w* - w) + i_ff(w*);   e = PI_current(i* - i) + K_b w
///     direct:   e = PI_direct(w* - w) + R i_ff(w*), where no current is measured
///
/// The current loop has its zero on L/R, the direct one on the motor's own time constant; the speed loop of the
/// cascade has its corner at a fifth of its bandwidth.
struct Gains {
  double speed_bandwidth = 0, current_bandwidth = 0;  ///< [Hz]
  Pi current;                                         ///< [V/A], [V/(A s)]
  Pi speed;                                           ///< [A s/rad], [A/rad]
  Pi direct;                                          ///< [V s/rad], [V/rad]
  double back_emf = 0;                                ///< [V s/rad] K_b of the cascade's decoupling
};

/// @param motor about the working point
/// @throws ModelError where the current loop would ring: less than 30 degrees are left of its phase.
Gains gains_for(const LinearMachine& motor, const LoopWishes& wishes);

enum class Loop { cascade, direct };

/// How far a loop is from ringing.
struct Margins {
  double phase = 0;      ///< [degree]
  double gain = 0;       ///< [dB] infinity where the phase never turns
  double crossover = 0;  ///< [Hz]
};

/// Of the open speed loop, with lag and delay of the driver and a delay of 1.5 samples of the controller.
Margins margins_of(const Gains& gains, const LinearMachine& motor, Loop loop, double rate);

/// The least margins over parameters drawn within their standard errors; the gains stay.
struct Spread {
  Margins least;
  std::size_t draws = 0;  ///< 0: the model has no standard errors
};
Spread spread_of(const Model& model, const WorkingPoint& at, const Gains& gains, Loop loop, double rate);

/// [A] that holds speeds against friction: what a feed-forward adds.
struct FeedForward {
  std::vector<double> omega, i_a, e_a;  ///< [rad/s], [A], [V] settled
};
FeedForward feed_forward_of(const Model& model, double top);

}  // namespace emtb
