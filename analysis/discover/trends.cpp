#include "analysis/discover/trends.h"

#include <cmath>

#include "analysis/discover/between_runs.h"
#include "analysis/fit/calibrate.h"
#include "analysis/numerics/parallel.h"

namespace emtb {

std::vector<Trend> trends(std::span<const std::vector<Record>> groups, const std::vector<std::string>& names,
                          const Model& fitted) {
  constexpr double least = 0.03;
  const FreeParameters free(fitted);
  std::vector<Trend> all(free.size());
  std::vector<Calibration> fits(groups.size());
  each_on_a_core(groups.size(), [&](std::size_t g) {
    fits[g] = calibrate(groups[g], fitted, {.extra_starts = 0, .max_iterations = 40, .tolerance = 1e-7});
  });
  for (std::size_t i = 0; i < free.size(); ++i) {
    Trend& t = all[i];
    const std::size_t place = free.places()[i];
    t.parameter = fitted.names()[place];
    t.unit = fitted.at(place).unit;
    std::vector<double> number, value, error;
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const Parameter& p = fits[g].model.at(place);
      if (!p.std_error || !(*p.std_error > 0)) continue;
      t.points.push_back({names[g], p.value, *p.std_error});
      number.push_back(static_cast<double>(g));
      value.push_back(p.value);
      error.push_back(*p.std_error);
    }
    if (value.size() < 3) continue;
    const DriftLine line = line_through(number, value, error);
    t.slope = line.slope;
    t.slope_error = line.slope_error;
    for (std::size_t k = 0; k < number.size(); ++k) {
      t.points[k].line = line.at(number[k]);
      t.points[k].line_error = line.error_at(number[k]);
    }
    const double whole = t.slope * (number.back() - number.front());
    t.whole = whole / std::abs(line.middle);
    t.clear = line.clear() && std::abs(t.whole) > least;
  }
  return all;
}

}  // namespace emtb
