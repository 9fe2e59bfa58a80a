#include "analysis/record/observation.h"

#include <algorithm>
#include <cmath>

#include "analysis/numerics/even_series.h"
#include "analysis/record/count_errors.h"

namespace emtb {
namespace {

std::uint32_t nearest(std::span<const double> grid, double t) {
  const auto above = std::ranges::lower_bound(grid, t);
  if (above == grid.begin()) return 0;
  if (above == grid.end()) return static_cast<std::uint32_t>(grid.size() - 1);
  const auto below = above - 1;
  return static_cast<std::uint32_t>((t - *below < *above - t ? below : above) - grid.begin());
}

/// The least-squares line through points: its slope, and what each of them has in it.
struct Line {
  double slope = 0;
  std::vector<double> weight;
};

Line line_through(std::span<const double> t, std::span<const double> y) {
  double middle = 0, squares = 0;
  for (const double at : t) middle += at / static_cast<double>(t.size());
  for (const double at : t) squares += (at - middle) * (at - middle);
  Line line;
  for (std::size_t j = 0; j < t.size(); ++j) {
    line.weight.push_back((t[j] - middle) / squares);
    line.slope += line.weight.back() * (y[j] - y.front());
  }
  return line;
}

/// [s] For so long the readings of an angle tell one speed: long against an encoder's steps, and short against a shaft,
/// for a run lasts several of its time constants.
double line_within(std::span<const double> t) { return std::min(0.02, 0.01 * (t.back() - t.front())); }

/// At least what a line or a change takes.
std::size_t rows_within(double seconds, std::span<const double> t) {
  return static_cast<std::size_t>(std::max(2.0, std::round(seconds / std::max(mean_interval(t), 1e-9))));
}

/// Gives each grid point its part of the weights at other times, linear in between.
/// @param first grid point that `out` begins with
void spread(std::span<const double> t, std::span<const double> weight, std::span<const double> grid, std::size_t first,
            std::span<double> out) {
  std::size_t k = 0;
  for (std::size_t j = 0; j < t.size(); ++j) {
    while (k + 2 < out.size() && grid[first + k + 1] <= t[j]) ++k;
    const double from = grid[first + k], to = grid[first + k + 1];
    const double share = std::clamp((t[j] - from) / (to - from), 0.0, 1.0);
    out[k] += (1 - share) * weight[j];
    out[k + 1] += share * weight[j];
  }
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
  std::vector<double> begin, end, value;
  std::vector<std::uint32_t> firsts, lasts;
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
    if (slow) {  // else a reading is an instant
      begin.push_back(start);
      firsts.push_back(first);
    }
    end.push_back(series.t[i]);
    lasts.push_back(last);
    value.push_back(series.value[i]);
  }
  o.end = std::move(end);
  o.last = std::move(lasts);
  o.value = std::move(value);
  o.begin = slow ? SharedColumn<double>(std::move(begin)) : o.end;
  o.first = slow ? SharedColumn<std::uint32_t>(std::move(firsts)) : o.last;
  o.end.share(series.t);
  o.value.share(series.value);
  return o;
}

Observation speed_of_encoder(const Series& theta, std::span<const double> grid, const AngleNoise& noise) {
  Observation o;
  o.signal = Signal::omega;
  o.functional = Functional::slope;
  o.origin = Origin::slope_of_angle;
  o.lsb = theta.lsb;
  const std::size_t n = theta.t.size();
  if (n < 2) return o;
  const std::size_t half = rows_within(0.5 * line_within(theta.t), theta.t);
  for (std::size_t k = half; k + half < n; k += half) {  // closer ones would share most of their noise
    const std::span t(&theta.t[k - half], 2 * half + 1), angle(&theta.value[k - half], 2 * half + 1);
    if (t.front() < grid.front() - 1e-9 || t.back() > grid.back() + 1e-9) continue;  // beyond what drives the model
    const Line line = line_through(t, angle);
    const auto first = static_cast<std::uint32_t>(std::ranges::upper_bound(grid, t.front()) - grid.begin()) - 1,
               last = static_cast<std::uint32_t>(
                   std::min<std::ptrdiff_t>(std::ranges::lower_bound(grid, t.back()) - grid.begin(),
                                            static_cast<std::ptrdiff_t>(grid.size()) - 1));
    o.begin.push_back(t.front());
    o.end.push_back(t.back());
    o.first.push_back(first);
    o.last.push_back(last);
    o.value.push_back(line.slope);
    o.weight_from.push_back(o.weight.size());
    o.weight.resize(o.weight.size() + last - first + 1, 0.0);
    spread(t, line.weight, grid, first, std::span(o.weight).last(last - first + 1));
  }
  if (theta.lsb > 0 && o.size() > 2) count_errors_of_slopes(o, theta, half, noise);
  return o;
}

Observation angle_increments(const Series& theta, std::span<const double> grid, const AngleNoise& noise) {
  const std::size_t span = rows_within(line_within(grid), grid);
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
  if (theta.lsb > 0 && o.size() > 2) count_errors_of_increments(o, noise);
  return o;
}

double Observation::covariance(std::size_t i, std::size_t j) const {
  const double apart = i > j ? static_cast<double>(i - j) : static_cast<double>(j - i);
  return sigma[i] * sigma[j] * std::pow(autocorrelation, apart);
}

}  // namespace emtb
