#pragma once

#include <functional>
#include <string>
#include <vector>

#include "analysis/estimate/static_estimate.h"
#include "paper/bench.h"
#include "paper/fits.h"

namespace emtb::paper {

/// Figure 6 on a bench that is wrong in one way: does K_m come out smaller than K_b, and what else changes?
struct TorqueConstantCase {
  std::string name;
  double K_m = 0, T_0 = 0;                             ///< by figure 6's line
  double R_a = 0, K_b = 0;                             ///< from the same readings, by the armature's equation
  double form_factor_first = 1, form_factor_last = 1;  ///< rms/mean of the current, without load and under the most
};

/// One way in which section 3.4's two numbers may have come about.
struct SwitchOnCase {
  std::string name;
  double current_low = 0, current_high = 0;  ///< [A] what the meter would show
  double acceleration = 0;                   ///< [rad/s2]
};

/// J by one method.
struct InertiaCase {
  std::string name;
  double J = 0, std_error = 0;
};

/// Which parameters some data determine.
struct IdentifiabilityCase {
  std::string data;
  OutputErrorFit fit;
};

/// All that the page tells, computed.
struct Findings {
  simulated::Setup bench;  ///< the truth
  simulated::Setup gauge;  ///< the bench whose gauge reads 0.745 of the truth

  StaticEstimate equation_6, armature, generator;                // 3.1
  StaticEstimate brake_line, machine_line, friction;             // 3.2
  std::vector<std::pair<double, double>> brake_slope_against_B;  ///< of the plant; figure 5's slope does not care
  StaticEstimate torque_constant;                                // 3.3
  std::vector<TorqueConstantCase> torque_constants;
  StaticEstimate slow_switch_on, fast_switch_on;  // 3.4
  std::vector<InertiaCase> inertias;
  double driver_acceleration = 0;  ///< [rad/s2] the largest behind the driver, simulated
  double driver_current = 0;       ///< [A] the largest behind it
  std::vector<SwitchOnCase> switch_ons;
  double window_shipped = 0, window_gauge = 0;              ///< [s] over which the current's mean is 1.73 A
  double acceleration_shipped = 0, acceleration_gauge = 0;  ///< [rad/s2] the mean over the same time
  double inductance_shipped = 0, inductance_gauge = 0;      ///< [H] for a peak of 1.73 A
  StaticEstimate driver_gain, driver_slopes;                // section 4, figure 8
  std::vector<Run> driver_runs;

  Run rising, both, contactor;  // figures 7 and 11
  OutputErrorFit both_parameters, only_inertia, with_falling_step, with_friction_rising, with_friction_both;
  OutputErrorFit gauge_rising;
  double printed_gain = 0, printed_time_constant = 0;  ///< of table 1's calibrated column
  double printed_B = 0, printed_J = 0;    ///< the same two numbers, with the electrical constants as estimated
  double needed_T_c = 0, needed_B = 0;    ///< [N m], [N m s/rad] in the gauge's units: of a plant whose fit gives these
  std::vector<OutputErrorFit> starts;     ///< all five parameters within bounds, from several starts
  std::vector<OutputErrorFit> unbounded;  ///< and without
  std::vector<IdentifiabilityCase> identifiability;
};

/// Runs everything on the simulated bench.
/// @param progress share 0 to 1, what is being done
Findings find(const std::function<void(double, const std::string&)>& progress = {});

}  // namespace emtb::paper
