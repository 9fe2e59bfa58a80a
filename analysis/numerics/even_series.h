#pragma once

#include <span>

namespace emtb {

/// [s] from one reading to the next of a series whose readings follow each other evenly.
/// @param t two times or more
double mean_interval(std::span<const double> t);

/// [s] Standard deviation of the times about even ones.
/// @param t two times or more
double jitter_of(std::span<const double> t);

/// [s] The last decimal that the times were written with, down to a tenth of a microsecond.
double last_digit_of(std::span<const double> t);

/// The least-squares line through readings that follow each other evenly, and how they scatter about it.
struct EvenLine {
  double variance = 0;    ///< about the line, of n - 2 degrees of freedom
  double covariance = 0;  ///< of neighbours, of as many
  double rise = 0;        ///< of the line over all readings, without its sign
  double before = 0;      ///< where the line lies one reading before the first
};

/// @param y three readings or more
EvenLine even_line(std::span<const double> y);

}  // namespace emtb
