#pragma once

#include <optional>
#include <string>
#include <vector>

#include "analysis/estimate/settled.h"
#include "analysis/numerics/line_fit.h"

namespace emtb {

inline constexpr double turning = 0.02;     ///< of the largest speed: faster than this, the shaft turns
inline constexpr double clear_of_zero = 5;  ///< standard errors

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
};

/// One static experiment: the numbers it gives, and all that one needs to judge and draw them.
struct StaticEstimate {
  std::string what = {};    ///< as `emtb estimate --what` calls it
  std::string method = {};  ///< `equation_6`: unique among all
  std::string title = {};   ///< for people: `e_a/i_a = K_b ω/i_a + R_a (equation 6)`
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
