#pragma once

#include <cstddef>

namespace emtb {

/// Means of points (x, y), and sums of squares and products about them: all that a least-squares line needs.
struct Moments {
  double x_mean = 0, y_mean = 0;
  double xx = 0, xy = 0, yy = 0;

  double slope() const { return xy / xx; }                        ///< of the line; not where all x are the same
  double intercept() const { return y_mean - slope() * x_mean; }  ///< of the line, at x = 0
};

/// @param n points
/// @param x, y called with 0 ... n - 1
template <class X, class Y>
Moments moments_of(std::size_t n, const X& x, const Y& y) {
  const auto count = static_cast<double>(n);
  Moments m;
  for (std::size_t k = 0; k < n; ++k) {
    m.x_mean += x(k) / count;
    m.y_mean += y(k) / count;
  }
  for (std::size_t k = 0; k < n; ++k) {
    const double dx = x(k) - m.x_mean, dy = y(k) - m.y_mean;
    m.xx += dx * dx;
    m.xy += dx * dy;
    m.yy += dy * dy;
  }
  return m;
}

}  // namespace emtb
