#include "analysis/estimate/stretch.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/numerics/even_series.h"
#include "analysis/numerics/moments.h"
#include "session/resolution.h"

namespace emtb {

Mean mean_of(std::span<const double> x, double lsb) {
  constexpr double longest_memory = 0.99;  // of the scatter: by hand, so that an error stays finite
  Mean mean{.readings = x.size()};
  if (x.empty()) return mean;
  const auto n = static_cast<double>(x.size());
  for (const double value : x) mean.value += value / n;
  double squares = 0, products = 0;
  for (std::size_t k = 0; k < x.size(); ++k) {
    squares += (x[k] - mean.value) * (x[k] - mean.value);
    if (k > 0) products += (x[k] - mean.value) * (x[k - 1] - mean.value);
  }
  const double variance = x.size() > 1 ? squares / (n - 1) : 0;
  const double correlation = squares > 0 ? std::clamp(products / squares, 0.0, longest_memory) : 0;
  // Readings that do not scatter over the steps of their instrument hide the same part of a step, all of them.
  const double hidden = variance < lsb * lsb / 4 ? lsb * lsb / 12 : 0;
  mean.std_error = std::sqrt(variance / n * (1 + correlation) / (1 - correlation) + hidden);
  return mean;
}

Mean mean_over(const Series& series, double from, double to) {
  const auto first =
      static_cast<std::size_t>(std::ranges::lower_bound(series.t, from - time_rounding) - series.t.begin());
  std::vector<double> inside;
  for (std::size_t k = first; k < series.t.size() && series.t[k] <= to + time_rounding; ++k) {
    if (series.window > 0 && window_start(series, k) < from - time_rounding) continue;
    inside.push_back(series.value[k]);
  }
  return mean_of(inside, series.lsb);
}

LocalLine local_line(const Series& series, double from, double to) {
  const auto first =
      static_cast<std::size_t>(std::ranges::lower_bound(series.t, from - time_rounding) - series.t.begin());
  const auto end = static_cast<std::size_t>(std::ranges::upper_bound(series.t, to + time_rounding) - series.t.begin());
  LocalLine line{.readings = end - first};
  if (line.readings < 2) {
    if (line.readings == 1) line.value = series.value[first];
    return line;
  }
  const auto n = static_cast<double>(line.readings);
  const double middle = (from + to) / 2;
  const Moments m = moments_of(
      line.readings, [&](std::size_t k) { return series.t[first + k] - middle; },
      [&](std::size_t k) { return series.value[first + k]; });
  line.slope = m.slope();
  line.value = m.intercept();
  const double hidden = series.lsb * series.lsb / 12;  // a signal on one step of its instrument is no certainty
  const double variance = n > 2 ? std::max((m.yy - line.slope * m.xy) / (n - 2), hidden) : hidden;
  line.slope_error = std::sqrt(variance / m.xx);
  line.value_error = std::sqrt(variance * (1 / n + m.x_mean * m.x_mean / m.xx));
  return line;
}

double largest_size(const Series& series) {
  double most = 0;
  for (const double x : series.value) most = std::max(most, std::abs(x));
  return most;
}

std::vector<Stretch> open_armature(const Run& run) {
  std::vector<Stretch> stretches;
  if (!run.has(Signal::armature_open)) return stretches;
  const Series& open = run.at(Signal::armature_open);
  for (std::size_t k = 0; k < open.t.size(); ++k) {
    if (open.value[k] <= 0) continue;
    const double from = open.t[k];
    while (k < open.t.size() && open.value[k] > 0) ++k;
    stretches.push_back({run.name, from, k < open.t.size() ? open.t[k] : run.duration()});
  }
  return stretches;
}

double lsb_of(const Series& series) {
  if (series.lsb > 0) return series.lsb;
  const std::array pieces{std::span<const double>(series.value)};
  constexpr bool may_be_set = true;  // a series by itself does not say
  return resolution(pieces, may_be_set);
}

double averaging_window(const Run& run, Signal signal) {
  const Series& series = run.at(signal);
  if (series.window != 0 || series.t.size() < 2 || !is_sparse(run, signal)) return series.window;
  return mean_interval(series.t);
}

}  // namespace emtb
