#include "analysis/record/observation.h"

#include <algorithm>
#include <cmath>

#include "analysis/numerics/even_series.h"

namespace emtb {
namespace {

std::uint32_t nearest(std::span<const double> grid, double t) {
  const auto above = std::ranges::lower_bound(grid, t);
  if (above == grid.begin()) return 0;
  if (above == grid.end()) return static_cast<std::uint32_t>(grid.size() - 1);
  const auto below = above - 1;
  return static_cast<std::uint32_t>((t - *below < *above - t ? below : above) - grid.begin());
}

}  // namespace

Observation observe(const Series& series, Signal signal, std::span<const double> grid, bool slow) {
  Observation o;
  o.signal = signal;
  o.functional = slow ? Functional::mean : Functional::instant;
  o.lsb = series.lsb;
  o.window = series.window;
  o.slow = slow;
  const double interval = mean_interval(grid);
  for (std::size_t i = 0; i < series.t.size(); ++i) {
    const std::uint32_t last = nearest(grid, series.t[i]);
    if (std::abs(grid[last] - series.t[i]) > 0.75 * interval) continue;  // beyond what drives the model
    std::uint32_t first = last;
    double start = series.t[i];
    if (slow) {
      if (i == 0 && series.window <= 0) continue;  // the mean since a reading that is not there
      start = series.window > 0 ? series.t[i] - series.window : series.t[i - 1];
      if (start < grid.front() - 0.75 * interval) continue;
      first = nearest(grid, start);
    }
    o.begin.push_back(start);
    o.end.push_back(series.t[i]);
    o.first.push_back(first);
    o.last.push_back(last);
    o.value.push_back(series.value[i]);
  }
  return o;
}

Series speed_from_angle(const Series& theta, std::size_t half) {
  Series omega;
  omega.source = "slope of " + theta.source;
  const std::size_t n = theta.t.size();
  if (n <= 2 * half) return omega;
  double squares = 0;
  for (std::size_t j = 1; j <= half; ++j) squares += 2.0 * static_cast<double>(j * j);
  for (std::size_t k = half; k + half < n; k += half) {  // closer ones would share most of their noise
    double sum = 0;
    for (std::size_t j = 1; j <= half; ++j) sum += static_cast<double>(j) * (theta.value[k + j] - theta.value[k - j]);
    const double interval = (theta.t[k + half] - theta.t[k - half]) / (2.0 * static_cast<double>(half));
    omega.t.push_back(theta.t[k]);
    omega.value.push_back(sum / squares / interval);
  }
  return omega;
}

Observation speed_of_encoder(const Series& theta, std::span<const double> grid) {
  const double interval = mean_interval(grid);
  // 21 ms are short against any shaft here and long against the encoder's steps.
  const auto half = static_cast<std::size_t>(std::max(2.0, std::round(0.01 / interval)));
  Observation o = observe(speed_from_angle(theta, half), Signal::omega, grid, false);
  o.functional = Functional::mean;
  o.origin = Origin::slope_of_angle;
  // The line's slope is a weighted mean of the speed over +-half; a plain mean over 0.775 of it has the same spread.
  const auto reach = static_cast<std::uint32_t>(std::lround(std::sqrt(0.6) * static_cast<double>(half)));
  for (std::size_t i = 0; i < o.size(); ++i) {
    o.first[i] -= std::min(o.first[i], reach);
    o.last[i] = std::min(o.last[i] + reach, static_cast<std::uint32_t>(grid.size() - 1));
    o.begin[i] = grid[o.first[i]];
    o.end[i] = grid[o.last[i]];
  }
  return o;
}

Observation angle_increments(const Series& theta, std::span<const double> grid) {
  const double interval = mean_interval(grid);
  const auto span = static_cast<std::size_t>(std::max(2.0, std::round(0.02 / interval)));
  Observation o;
  o.signal = Signal::theta;
  o.functional = Functional::increment;
  o.origin = Origin::counts;
  o.lsb = theta.lsb;
  const Observation angle = observe(theta, Signal::theta, grid, false);
  for (std::size_t i = span; i < angle.size(); i += span) {
    o.begin.push_back(angle.end[i - span]);
    o.end.push_back(angle.end[i]);
    o.first.push_back(angle.last[i - span]);
    o.last.push_back(angle.last[i]);
    o.value.push_back(angle.value[i] - angle.value[i - span]);
  }
  return o;
}

double Observation::covariance(std::size_t i, std::size_t j) const {
  const double apart = i > j ? static_cast<double>(i - j) : static_cast<double>(j - i);
  return sigma[i] * sigma[j] * std::pow(autocorrelation, apart);
}

}  // namespace emtb
