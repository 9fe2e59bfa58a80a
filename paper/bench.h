#pragma once

#include <span>
#include <vector>

#include "drivers/simulated/recording.h"

namespace emtb::paper {

/// What Erdal et al. (2011) state; docs/paper.md on the misprints.
namespace printed {
inline constexpr double R_a = 31.825;  ///< [ohm] figure 4's intercept, table 1; the text once says 3.825
inline constexpr double K_b = 0.6739;  ///< [V s/rad] figure 4's slope
inline constexpr double K_b_generator = 0.7182;
inline constexpr double B = 0.0001;                ///< [N m s/rad] figure 5's slope
inline constexpr double T_L = 0.0865;              ///< [N m] figure 5's intercept
inline constexpr double K_m = 0.5024;              ///< [N m/A] figure 6's slope
inline constexpr double T_0 = 0.0547;              ///< [N m] figure 6's intercept, negative there
inline constexpr double K_m_of_product = 0.5349;   ///< [N m/A] by which section 3.4 multiplies
inline constexpr double i_max = 1.73;              ///< [A] section 3.4
inline constexpr double acceleration = 268.29;     ///< [rad/s2] figure 7
inline constexpr double J = 0.003449;              ///< [kg m2]
inline constexpr double rise = 22.5, fall = 20.4;  ///< [V/s] figure 8
inline constexpr double R_a_calibrated = 31.606, K_b_calibrated = 0.6798, K_m_calibrated = 0.5065,
                        B_calibrated = 0.0009, J_calibrated = 0.0050;  ///< table 1
inline constexpr double voltage = 110;                                 ///< [V] nominal
inline constexpr double reference = 6;                                 ///< [V] for it
}  // namespace printed

/// The simulated FH2 bench as shipped (config/benches/fh2-simulated.yaml), read at 250 Hz: its time constants are
/// tenths of seconds.
simulated::Setup fh2();

/// The same bench as the paper's numbers describe it if the torque gauge reads 0.745 of the truth: every torque and the
/// inertia are larger by 1/0.745, so that the gauge shows the paper's.
simulated::Setup with_gauge_gain(simulated::Setup setup, double gain);

/// With a fast ammeter instead of the slow meter.
simulated::Setup with_fast_ammeter(simulated::Setup setup);

/// A full-wave rectifier on the mains instead of a smooth driver, and a meter that reads rms.
/// @param crest [V] of the mains behind a phase-controlled one; 0: uncontrolled
simulated::Setup rectified(simulated::Setup setup, double crest);

/// An eddy-current brake so chosen that the straight line through its torque is the one of figure 5: it works near the
/// speed of its largest torque, where the torque hardly changes.
simulated::LoadParameters brake_of_figure_5();

// The experiments. Each is one run from rest; all noise is seeded.
Run raise_voltage(const simulated::Setup& setup);  ///< figure 4: no load, 0.5 to 6 V in steps
Run lower_voltage(const simulated::Setup& setup, const simulated::LoadParameters& brake);  ///< figure 5: brake set once
Run turn_up_brake(const simulated::Setup& setup, double reference = printed::reference);   ///< figure 6: one voltage
Run close_contactor(const simulated::Setup& setup);  ///< figure 7: the full voltage at once, past the driver
Run open_armature(const simulated::Setup& setup);    ///< coast-down from full speed
Run step_up(const simulated::Setup& setup);          ///< figure 11: one rising step to full voltage
Run step_up_and_down(const simulated::Setup& setup);
std::vector<Run> driver_steps(const simulated::Setup& setup);  ///< figure 8: three levels, up and down

}  // namespace emtb::paper
