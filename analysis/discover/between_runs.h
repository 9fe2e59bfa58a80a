#pragma once

#include <span>

namespace emtb {

/// The variance of some values beside their own errors, and how many degrees of freedom it is known with.
struct Between {
  double variance = 0, freedom = 1;
};

/// After DerSimonian and Laird (1986). Values without a finite error do not count.
/// @param off what the values are off a mean or a line @param lost degrees of freedom that this took
Between between_runs(std::span<const double> off, std::span<const double> error, double lost);

/// The factor on a standard error that has as many false alarms as three of a normal one, for Student's t.
/// Source: Wallace (1959), Bounds on normal approximations to Student's and the chi-square distributions.
double as_rare_as_three(double degrees_of_freedom);

/// Is a difference beyond three standard errors, the scatter between runs among them? As few runs hardly tell that, the
/// three is that of Student's t with as many degrees of freedom as the sum has (Welch and Satterthwaite).
bool beyond(double off, double std_error, const Between& between);

/// The straight line through values with errors, and with a scatter of their own between runs.
struct DriftLine {
  double middle_at = 0;  ///< weighed mean of x: there the errors of both are independent
  double middle = 0, middle_error = 0, slope = 0, slope_error = 0;
  Between between;

  double at(double x) const { return middle + slope * (x - middle_at); }
  double error_at(double x) const;
  bool clear() const;  ///< the slope is beyond() nothing
};

/// Of fewer than three values with finite errors a line of slope zero and infinite error.
DriftLine line_through(std::span<const double> x, std::span<const double> value, std::span<const double> error);

}  // namespace emtb
