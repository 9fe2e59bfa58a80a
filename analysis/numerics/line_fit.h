#pragma once

#include <cstddef>
#include <span>

namespace emtb {

/// A point of a straight line, with what its coordinates may be off.
struct LinePoint {
  double x = 0, y = 0;
  double sigma_x = 0, sigma_y = 0;  ///< standard errors; all zero: unknown
  double correlation = 0;           ///< of the errors of x and y, -1 to 1
};

/// y = intercept + slope x
struct LineFit {
  double slope = 0, intercept = 0;
  double slope_error = 0, intercept_error = 0;  ///< standard errors
  double r_squared = 0;                         ///< share of the variance of y that the line explains, unweighted
  double scatter = 0;                           ///< standard deviation of the points about the line, in y
  std::size_t points = 0;

  double at(double x) const { return intercept + slope * x; }
};

/// The straight line through points that err in both coordinates.
///
/// Minimises  Σ W_i (y_i - a - b x_i)²  with  W_i = 1 / (σ_y² + b² σ_x² - 2 b r σ_x σ_y),  which is the maximum
/// likelihood for Gaussian errors; Deming's regression and weighted least squares are special cases. Where no point
/// states an error it is ordinary least squares. Standard errors are those that the points' own errors give, widened
/// by the scatter about the line where that is larger. A point without errors among others that have them takes the
/// smallest of theirs.
/// Source: York, Evensen, Martinez, De Basabe Delgado, "Unified equations for the slope, intercept, and standard
/// errors of the best straight line", Am. J. Phys. 72 (2004) 367.
/// @throws SessionError for fewer than three points, or where all have the same x.
LineFit fit_line(std::span<const LinePoint> points);

}  // namespace emtb
