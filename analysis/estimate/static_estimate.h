#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/estimate/stretch.h"
#include "analysis/numerics/line_fit.h"

namespace emtb {

/// What is asked of the runs: sections 3 and 4 of Erdal et al. (2011), and inverse dynamics beside them.
enum class StaticExperiment {
  resistance,
  generator,
  friction,
  torque_constant,
  inertia,
  coast_down,
  driver,
  inverse_dynamics,
};
inline constexpr std::array static_experiments{StaticExperiment::resistance, StaticExperiment::generator,
                                               StaticExperiment::friction,   StaticExperiment::torque_constant,
                                               StaticExperiment::inertia,    StaticExperiment::coast_down,
                                               StaticExperiment::driver,     StaticExperiment::inverse_dynamics};

/// How it is answered. One question may have several answers.
enum class StaticMethod {
  equation_6,
  armature,
  generator,
  load_line,
  friction,
  torque_constant,
  switch_on,
  acceleration,
  whole_run,  ///< J by a fit of the model
  coast_down,
  driver_gain,
  driver_slopes,
  inverse_dynamics,
};

/// The question that a method answers.
StaticExperiment experiment_of(StaticMethod method);

/// As the command line, JSON and the names of pictures spell them: `torque-constant`, `equation_6`.
std::string_view name(StaticExperiment experiment);
std::string_view name(StaticMethod method);

/// Of the largest speed: faster than this, the shaft turns; dry friction is T_c there. By hand: above the noise and the
/// offset of a tacho.
inline constexpr double turning = 0.02;

/// Standard errors. By hand: five are nobody's chance.
inline constexpr double clear_of_zero = 5;

/// A number found by experiment.
struct Quantity {
  std::string symbol = {};  ///< `R_a`, `dω/dt`
  double value = 0;
  double std_error = 0;
  std::string unit = {};
};

/// What an analysis draws: readings over each other, the points used, those left out.
struct EstimateSeries {
  std::string name = {};
  std::vector<double> x = {}, y = {};
  std::vector<double> y_error = {};  ///< empty: none known
  bool joined = false;               ///< a line rather than points

  void add(const LinePoint& point);  ///< with its error in y
};

/// A stretch of a signal over the time since `origin`, thinned to what can be drawn.
EstimateSeries curve_of(const Series& series, const Stretch& stretch, double origin);

/// One static experiment: the numbers it gives, and all that one needs to judge and draw them.
struct StaticEstimate {
  StaticMethod method{};
  std::string title = {};  ///< for people: `e_a/i_a = K_b ω/i_a + R_a (equation 6)`
  std::vector<Quantity> quantities = {};
  double r_squared = 0;
  std::size_t points = 0;
  std::vector<Stretch> used = {};
  std::vector<LeftOut> left_out = {};
  std::vector<std::string> remarks = {};  ///< what limits the numbers
  std::string lacking = {};  ///< not empty: no numbers; what the data lack, and which experiment would give it

  std::string x_label = {}, x_unit = {}, y_label = {}, y_unit = {};
  std::vector<EstimateSeries> series = {};
  std::optional<LineFit> line = {};  ///< through the first series

  bool has(const std::string& symbol) const;
  const Quantity& at(const std::string& symbol) const;  ///< @throws SessionError where there is none
};

/// Standard error of a product or quotient of two numbers that err independently.
/// @param relative_a, relative_b their standard errors over themselves
double quotient_error(double value, double relative_a, double relative_b);

/// What is lacking where nobody says what torque a current makes.
inline constexpr const char* needs_K_m = "needs K_m. Give --model FILE, or record e_a too: K_b of the armature is K_m";

/// What other experiments have found, for those that need it.
struct KnownParameters {
  std::optional<Quantity> K_m = {};  ///< [N m/A]
  std::optional<Quantity> T_c = {};  ///< [N m]
  std::optional<Quantity> B = {};    ///< [N m s/rad]
  bool K_m_is_guess = false;         ///< a start value: whatever the data say of K_m is better
  std::string K_m_from = {};         ///< for people: `the model`, `K_b by equation (6)`
  std::string T_c_from = {};
};

}  // namespace emtb
