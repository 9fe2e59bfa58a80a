#include "analysis/numerics/line_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "analysis/numerics/moments.h"
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

Moments moments_of_points(std::span<const LinePoint> points) {
  const Moments m = moments_of(
      points.size(), [&](std::size_t k) { return points[k].x; }, [&](std::size_t k) { return points[k].y; });
  if (!(m.xx > 0)) {
    throw SessionError("a line needs points at different places, all are at " + std::to_string(m.x_mean));
  }
  return m;
}

/// W_i of a point at some slope. Errors that cancel wholly would make one point count for all.
double weight(const LinePoint& p, double slope) {
  constexpr double least_variance = 1e-12;  // of that of uncorrelated errors: by hand, far below any correlation met
  const double variance =
      square(p.sigma_y) + square(slope * p.sigma_x) - 2 * slope * p.correlation * p.sigma_x * p.sigma_y;
  return 1 / std::max(variance, least_variance * (square(p.sigma_y) + square(slope * p.sigma_x)));
}

/// The line after one of York's steps, and what its standard errors are made of.
struct YorkLine {
  double slope = 0, intercept = 0;
  double x_adjusted = 0;  ///< mean of where the points were meant to lie
  double weights = 0;     ///< their sum
  double spread = 0;      ///< weighted, of where the points were meant to lie
};

/// The slope that follows from the weights at this slope: equations (13) of York et al.
YorkLine york_step(std::span<const LinePoint> points, double slope) {
  YorkLine next;
  double x_bar = 0, y_bar = 0;
  for (const LinePoint& p : points) {
    const double w = weight(p, slope);
    next.weights += w;
    x_bar += w * p.x;
    y_bar += w * p.y;
  }
  x_bar /= next.weights;
  y_bar /= next.weights;
  // beta: how far the point that was meant lies from the middle.
  const auto beta = [&](const LinePoint& p) {
    const double u = p.x - x_bar, v = p.y - y_bar;
    return weight(p, slope) * (u * square(p.sigma_y) + slope * v * square(p.sigma_x) -
                               (slope * u + v) * p.correlation * p.sigma_x * p.sigma_y);
  };
  double up = 0, down = 0, beta_bar = 0;
  for (const LinePoint& p : points) {
    const double w = weight(p, slope), b = beta(p);
    up += w * b * (p.y - y_bar);
    down += w * b * (p.x - x_bar);
    beta_bar += w * b / next.weights;
  }
  for (const LinePoint& p : points) next.spread += weight(p, slope) * square(beta(p) - beta_bar);
  next.slope = up / down;
  next.intercept = y_bar - next.slope * x_bar;
  next.x_adjusted = x_bar + beta_bar;
  return next;
}

YorkLine york_line(std::span<const LinePoint> points, double start) {
  constexpr int most_steps = 100;           // ten are usual
  constexpr double hardly_changes = 1e-13;  // of the slope: some hundred last digits
  YorkLine line{.slope = start};
  for (int n = 0; n < most_steps; ++n) {
    const double before = line.slope;
    line = york_step(points, before);
    if (std::abs(line.slope - before) <= hardly_changes * std::abs(before)) break;
  }
  return line;
}

}  // namespace

LineFit fit_line(std::span<const LinePoint> given) {
  if (given.size() < 3) throw SessionError("a line needs three points, here are " + std::to_string(given.size()));
  const bool known = std::ranges::any_of(given, [](const LinePoint& p) { return p.sigma_x > 0 || p.sigma_y > 0; });
  const std::vector<LinePoint> points = with_errors(given, known);
  const Moments plain = moments_of_points(points);
  const YorkLine line = york_line(points, plain.slope());

  LineFit fit{.slope = line.slope, .intercept = line.intercept, .points = points.size()};
  double chi2 = 0, left = 0;
  for (const LinePoint& p : points) {
    const double miss = p.y - fit.at(p.x);
    chi2 += weight(p, fit.slope) * square(miss);
    left += square(miss);
  }
  const double degrees_of_freedom = static_cast<double>(points.size()) - 2;
  const double reduced = chi2 / degrees_of_freedom;
  const double widening = known ? std::sqrt(std::max(1.0, reduced)) : std::sqrt(reduced);
  fit.slope_error = widening / std::sqrt(line.spread);
  fit.intercept_error = widening * std::sqrt(1 / line.weights + square(line.x_adjusted) / line.spread);
  fit.r_squared = plain.yy > 0 ? 1 - left / plain.yy : 1;
  fit.scatter = std::sqrt(left / degrees_of_freedom);
  return fit;
}

}  // namespace emtb
