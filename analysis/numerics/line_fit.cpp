#include "analysis/numerics/line_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

double square(double x) { return x * x; }

/// Every point with errors of its own; all alike where none are known.
std::vector<LinePoint> with_errors(std::span<const LinePoint> points, bool known) {
  std::vector<LinePoint> all(points.begin(), points.end());
  double least_x = std::numeric_limits<double>::infinity(), least_y = least_x;
  for (const LinePoint& p : all) {
    if (p.sigma_x > 0) least_x = std::min(least_x, p.sigma_x);
    if (p.sigma_y > 0) least_y = std::min(least_y, p.sigma_y);
  }
  for (LinePoint& p : all) {
    if (!known) p.sigma_y = 1;
    if (p.sigma_x > 0 || p.sigma_y > 0) continue;
    if (std::isfinite(least_x)) p.sigma_x = least_x;
    if (std::isfinite(least_y)) p.sigma_y = least_y;
    p.correlation = 0;
  }
  return all;
}

}  // namespace

LineFit fit_line(std::span<const LinePoint> given) {
  if (given.size() < 3) throw SessionError("a line needs three points, here are " + std::to_string(given.size()));
  const bool known = std::ranges::any_of(given, [](const LinePoint& p) { return p.sigma_x > 0 || p.sigma_y > 0; });
  const std::vector<LinePoint> points = with_errors(given, known);
  const auto n = static_cast<double>(points.size());
  double x_mean = 0, y_mean = 0;
  for (const LinePoint& p : points) x_mean += p.x / n, y_mean += p.y / n;
  double xx = 0, xy = 0, yy = 0;
  for (const LinePoint& p : points) {
    xx += square(p.x - x_mean);
    xy += (p.x - x_mean) * (p.y - y_mean);
    yy += square(p.y - y_mean);
  }
  if (!(xx > 0)) throw SessionError("a line needs points at different places, all are at " + std::to_string(x_mean));

  double slope = xy / xx, intercept = 0, x_adjusted = 0, weights = 0, spread = 0;
  const auto weight = [&](const LinePoint& p) {
    const double variance =
        square(p.sigma_y) + square(slope * p.sigma_x) - 2 * slope * p.correlation * p.sigma_x * p.sigma_y;
    return 1 / std::max(variance, 1e-12 * (square(p.sigma_y) + square(slope * p.sigma_x)));
  };
  for (int n_step = 0; n_step < 100; ++n_step) {
    double x_bar = 0, y_bar = 0;
    weights = 0;
    for (const LinePoint& p : points) {
      const double w = weight(p);
      weights += w;
      x_bar += w * p.x;
      y_bar += w * p.y;
    }
    x_bar /= weights;
    y_bar /= weights;
    // beta: how far the point that was meant lies from the middle.
    const auto beta = [&](const LinePoint& p) {
      const double u = p.x - x_bar, v = p.y - y_bar;
      return weight(p) * (u * square(p.sigma_y) + slope * v * square(p.sigma_x) -
                          (slope * u + v) * p.correlation * p.sigma_x * p.sigma_y);
    };
    double up = 0, down = 0, beta_bar = 0;
    for (const LinePoint& p : points) {
      const double w = weight(p), b = beta(p);
      up += w * b * (p.y - y_bar);
      down += w * b * (p.x - x_bar);
      beta_bar += w * b / weights;
    }
    spread = 0;
    for (const LinePoint& p : points) spread += weight(p) * square(beta(p) - beta_bar);
    const double next = up / down;
    const bool there = std::abs(next - slope) <= 1e-13 * std::abs(slope);
    slope = next;
    intercept = y_bar - slope * x_bar;
    x_adjusted = x_bar + beta_bar;
    if (there) break;
  }

  LineFit fit{.slope = slope, .intercept = intercept, .points = points.size()};
  double chi2 = 0, left = 0;
  for (const LinePoint& p : points) {
    const double miss = p.y - fit.at(p.x);
    chi2 += weight(p) * square(miss);
    left += square(miss);
  }
  const double reduced = chi2 / (n - 2);
  const double widening = known ? std::sqrt(std::max(1.0, reduced)) : std::sqrt(reduced);
  fit.slope_error = widening / std::sqrt(spread);
  fit.intercept_error = widening * std::sqrt(1 / weights + square(x_adjusted) / spread);
  fit.r_squared = yy > 0 ? 1 - left / yy : 1;
  fit.scatter = std::sqrt(left / (n - 2));
  return fit;
}

}  // namespace emtb
