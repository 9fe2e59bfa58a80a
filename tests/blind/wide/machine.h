#pragma once

#include <limits>
#include <string>

#include "tests/blind/draw.h"

namespace emtb::blind::wide {

/// A DC machine of any size and its driver, drawn by lot. Angle and speed of a linear axis are in m and m/s, its
/// torques are forces.
struct Machine {
  std::string kind;       ///< `small_servo`, `gear_motor`, `bench_100V`, `big_dc`, `linear_axis`
  double R = 1, K = 1;    ///< [ohm], [V s/rad]
  double B = 0, J = 1;    ///< [N m s/rad], [kg m2]
  double voltage = 1;     ///< [V] the most that the driver gives
  double speed = 1;       ///< [rad/s] about what it runs at with that
  double current = 1;     ///< [A] rated
  double torque = 1;      ///< [N m] of that current
  double tau = 1;         ///< [s] with which the speed follows the voltage
  bool linear = false;    ///< an axis that moves along a line: nothing repeats with its angle
  bool both_ways = true;  ///< the driver gives both signs
  double gain = 1;        ///< [V/V] of the driver
  double slew = std::numeric_limits<double>::infinity();  ///< [V/s] of the driver, both ways

  /// [s] The slower of the motor and its driver: how long a change takes.
  double change() const;
};

/// R, K and J come from what is drawn log-uniformly: voltage, power, speed, the share of the voltage that R takes at
/// rated current, and tau.
Machine draw_machine(Draw& draw);

}  // namespace emtb::blind::wide
