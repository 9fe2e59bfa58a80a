#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace emtb {

/// Least squares of y on several columns: y = Σ value_i column_i.
struct Regression {
  std::vector<double> value;
  std::vector<double> std_error;
  double r_squared = 0;  ///< share of the variance of y explained, unweighted
  double scatter = 0;    ///< standard deviation of what is left
  std::size_t rows = 0;
};

/// @param sigma standard error of each y; empty: unknown, all alike. Known errors set the standard errors of the
/// values, which are widened where what is left is larger.
/// @throws SessionError where there are not more rows than columns.
Regression regress(std::span<const std::vector<double>> columns, const std::vector<double>& y,
                   std::span<const double> sigma = {});

}  // namespace emtb
