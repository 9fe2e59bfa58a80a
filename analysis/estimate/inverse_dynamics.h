#pragma once

#include <span>
#include <string>
#include <vector>

#include "session/session.h"

namespace emtb {

/// Shaft parameters by linear regression.
struct InverseDynamics {
  struct Value {
    std::string symbol;  ///< J, B, T_c, T_L
    std::string unit;
    double value = 0;
    double std_error = 0;
  };
  std::vector<Value> values;
  double residual = 0;  ///< [N m] standard deviation of what is left
  double r_squared = 0;
  std::size_t rows = 0;  ///< independent equations after decimation
};

/// Solves  K_m i_a = J dω/dt + B ω + T_c sign(ω) + T_L  for J, B, T_c and T_L by least squares, without a simulation.
///
/// Everything in the equation passes the same smoothing: speed is the slope of a least-squares line through the angle
/// over +-20 ms, acceleration the slope of a line through the speed, and i_a, ω and sign(ω) are weighed by the kernels
/// of those slopes, so that smoothing biases nothing. Rows are thinned to one a kernel length. Readings near standstill
/// are left out: dry friction is not T_c there. Independent of output error: it needs a fast current, and noise in the
/// speed biases it (errors in variables).
/// @param k_m [N m/A]; @throws SessionError where i_a or both of omega and theta are missing or too slow.
InverseDynamics inverse_dynamics(std::span<const Run> runs, double k_m);

}  // namespace emtb
