#pragma once

#include <span>
#include <string>
#include <vector>

#include "analysis/record/record.h"
#include "model/model.h"

namespace emtb {

/// What the equations lack in one run, over time, with the states in which it was missing.
struct MissingTorque {
  std::string run;
  std::vector<double> t;              ///< [s] n times, evenly spaced
  std::vector<double> torque;         ///< [N m] it accelerates
  std::vector<double> torque_error;   ///< [N m] standard error of each
  std::vector<double> voltage;        ///< [V] added to the terminals; zeros where no current is read fast enough
  std::vector<double> voltage_error;  ///< [V]
  std::vector<double> omega, i_a, theta, u_ref, acceleration;  ///< [rad/s, A, rad, V, rad/s2] of the motion
  /// [A] of the smoothed motion, where `i_a` is the simulation's: torque, smoothed current and smoothed speed are tied
  /// by the equation of motion, so that what is missing would always be a line in the three.
  std::vector<double> i_a_smoothed;
};

/// The missing torque and voltage of all runs.
struct WhatIsLeft {
  std::vector<MissingTorque> runs;
  double torque_intensity = 0;   ///< [(N m)^2/s] of the random walk; 0: nothing is missing beyond the noise
  double voltage_intensity = 0;  ///< [V^2/s]
  bool voltage_seen = false;     ///< a current was read fast enough to tell torque from voltage
  double voltage_scale = 0;      ///< [V] rms of what drives the armature, by the simulated current
  double torque_scale = 0;       ///< [N m] rms of the motor's torque
};

/// Recovers the missing torque and voltage by a Kalman filter and Rauch, Tung and Striebel's smoother.
///
/// The state is the deviation of the speed from the fitted model's simulation, and the torque T and voltage V that the
/// model lacks, each a random walk:
///
///     J d(dw)/dt = K_m di - B dw + T,   di = (V - K_b dw)/R_a   (with a current drive di = 0)
///
/// It is read by the residuals of speed and current. So what the model says of friction and effects enters by the
/// simulation itself, and only its change with the small deviation dw is left out. The intensities of the two walks are
/// those of largest likelihood on a grid of factors of three (Kristensen, Madsen and Jorgensen 2004). Readings are
/// averaged to some 4000 intervals in all. @throws ModelError where a simulation is not finite.
WhatIsLeft what_is_left(std::span<const Record> records, const Model& fitted);

/// The same where runs have models of their own. @param fitted one a record
WhatIsLeft what_is_left(std::span<const Record> records, std::span<const Model> fitted);

}  // namespace emtb
