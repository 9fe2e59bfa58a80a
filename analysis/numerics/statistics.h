#pragma once

#include <cstddef>
#include <vector>

namespace emtb {

/// P(χ² > x), χ² with this many degrees of freedom: the p-value of a sum of so many squares of standard normals.
///
/// By the recurrence over the degrees of freedom,  Q(x, q + 2) = Q(x, q) + (x/2)^(q/2) exp(-x/2) / Γ(q/2 + 1),  from
/// Q(x, 1) = erfc √(x/2)  and  Q(x, 2) = exp(-x/2).
/// Source: Abramowitz, Stegun, Handbook of Mathematical Functions (1964), 26.4.8.
/// @param degrees_of_freedom one or more
/// @return 1 for x <= 0
double chi_squared_tail(double x, std::ptrdiff_t degrees_of_freedom);

/// The x above which a standard normal lies with the probability `tail`: where a one-sided test has to draw the line
/// for so many false alarms.
/// @param tail 0 to 0.5
double normal_quantile(double tail);

/// The median, of an even number the upper of the two in the middle; not of nothing.
double median(std::vector<double> x);

/// The standard deviation of normal deviations, by their median size: 1.4826 median|x|. Not of nothing.
/// @param sizes of the deviations, without their signs
double robust_sigma(std::vector<double> sizes);

}  // namespace emtb
