#include "analysis/estimate/stretches.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "hal/error.h"
#include "session/resolution.h"
#include "session/text.h"

namespace emtb {

std::vector<const SettledPoint*> points_with(const Settled& settled, std::span<const Signal> signals,
                                             StaticEstimate& result) {
  result.left_out.insert(result.left_out.end(), settled.left_out.begin(), settled.left_out.end());
  std::vector<const SettledPoint*> points;
  for (const SettledPoint& p : settled.points) {
    std::vector<std::string> missing;
    for (const Signal signal : signals) {
      if (!p.has(signal)) missing.emplace_back(info(signal).name);
    }
    if (p.has(Signal::armature_open) && p.at(Signal::armature_open) > 0) {
      result.left_out.push_back({p.where, "the armature is open"});
    } else if (!missing.empty()) {
      result.left_out.push_back({p.where, "no reading of " + listed(missing) + " lies in it"});
    } else {
      points.push_back(&p);
    }
  }
  return points;
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
  return resolution(pieces);
}

LocalLine local_line(const Series& series, double from, double to) {
  const auto first = static_cast<std::size_t>(std::ranges::lower_bound(series.t, from - 1e-9) - series.t.begin());
  const auto end = static_cast<std::size_t>(std::ranges::upper_bound(series.t, to + 1e-9) - series.t.begin());
  LocalLine line{.readings = end - first};
  if (line.readings < 2) {
    if (line.readings == 1) line.value = series.value[first];
    return line;
  }
  const auto n = static_cast<double>(line.readings);
  const double middle = (from + to) / 2;
  double t_mean = 0, y_mean = 0, tt = 0, ty = 0, yy = 0;
  for (std::size_t k = first; k < end; ++k) t_mean += (series.t[k] - middle) / n, y_mean += series.value[k] / n;
  for (std::size_t k = first; k < end; ++k) {
    const double t = series.t[k] - middle - t_mean, y = series.value[k] - y_mean;
    tt += t * t, ty += t * y, yy += y * y;
  }
  line.slope = ty / tt;
  line.value = y_mean - line.slope * t_mean;
  const double hidden = series.lsb * series.lsb / 12;  // a signal on one step of its instrument is no certainty
  const double variance = n > 2 ? std::max((yy - line.slope * ty) / (n - 2), hidden) : hidden;
  line.slope_error = std::sqrt(variance / tt);
  line.value_error = std::sqrt(variance * (1 / n + t_mean * t_mean / tt));
  return line;
}

}  // namespace emtb
