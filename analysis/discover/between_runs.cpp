#include "analysis/discover/between_runs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace emtb {

Between between_runs(std::span<const double> off, std::span<const double> error, double lost) {
  double sum = 0, weights = 0, squared = 0, count = 0;
  for (std::size_t i = 0; i < off.size(); ++i) {
    if (!(error[i] > 0) || !std::isfinite(error[i])) continue;
    const double w = 1 / (error[i] * error[i]);
    sum += w * off[i] * off[i];
    weights += w;
    squared += w * w;
    count += 1;
  }
  Between b;
  b.freedom = std::max(1.0, count - lost);
  const double scale = weights > 0 ? weights - squared / weights : 0;
  if (count > lost && scale > 0) b.variance = std::max(0.0, (sum - b.freedom) / scale);
  return b;
}

double as_rare_as_three(double nu) {
  constexpr double z = 3;
  const double corrected = z * (8 * nu + 3) / (8 * nu + 1);
  return std::sqrt(nu * std::expm1(corrected * corrected / nu));
}

bool beyond(double off, double std_error, const Between& between) {
  const double variance = std_error * std_error + between.variance;
  if (!(variance > 0) || !std::isfinite(variance)) return false;
  const double share = between.variance / variance;
  const double limit = share > 0 ? as_rare_as_three(between.freedom / (share * share)) : 3;
  return std::abs(off) > limit * std::sqrt(variance);
}

double DriftLine::error_at(double x) const { return std::hypot(middle_error, slope_error * (x - middle_at)); }

bool DriftLine::clear() const {
  const double limit = between.variance > 0 ? as_rare_as_three(between.freedom) : 3;
  return std::abs(slope) > limit * slope_error;
}

DriftLine line_through(std::span<const double> x, std::span<const double> value, std::span<const double> error) {
  DriftLine line;
  const auto fit = [&] {
    double w = 0, wx = 0, wy = 0, count = 0;
    std::vector<double> weight;
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double variance = error[i] * error[i] + line.between.variance;
      weight.push_back(error[i] > 0 && std::isfinite(variance) ? 1 / variance : 0);
      w += weight[i], wx += weight[i] * x[i], wy += weight[i] * value[i], count += weight[i] > 0 ? 1 : 0;
    }
    line.slope = 0;
    line.slope_error = line.middle_error = std::numeric_limits<double>::infinity();
    if (count < 1) return;
    line.middle_at = wx / w;
    line.middle = wy / w;
    line.middle_error = std::sqrt(1 / w);
    double xx = 0, xy = 0;
    for (std::size_t i = 0; i < x.size(); ++i) {
      xx += weight[i] * (x[i] - line.middle_at) * (x[i] - line.middle_at);
      xy += weight[i] * (x[i] - line.middle_at) * (value[i] - line.middle);
    }
    if (count < 3 || !(xx > 0)) return;
    line.slope = xy / xx;
    line.slope_error = std::sqrt(1 / xx);
  };
  fit();
  std::vector<double> off;
  for (std::size_t i = 0; i < x.size(); ++i) off.push_back(value[i] - line.at(x[i]));
  line.between = between_runs(off, error, 2);
  if (line.between.variance > 0) fit();  // once more, with the scatter that this has seen
  return line;
}

}  // namespace emtb
