#include "analysis/diagnose/overlay.h"

#include <cmath>

#include "analysis/fit/residuals.h"

namespace emtb {

std::vector<double> Overlay::residual() const {
  std::vector<double> r(t.size());
  for (std::size_t i = 0; i < r.size(); ++i) r[i] = measured[i] - simulated[i];
  return r;
}

double Overlay::floors() const {
  double sum = 0;
  for (std::size_t i = 0; i < t.size(); ++i) sum += std::pow((measured[i] - simulated[i]) / sigma[i], 2);
  return t.empty() ? 0 : std::sqrt(sum / static_cast<double>(t.size()));
}

std::vector<Overlay> overlays(const Record& record, const Model& model) {
  const std::vector<Residuals> all = residuals(std::span(&record, 1), 0, record.structure(model), model.values(), {});
  const std::vector<double>& grid = record.excitation.t;
  std::vector<Overlay> list;
  for (std::size_t s = 0; s < all.size(); ++s) {
    const Observation& o = record.observations[s];
    Overlay y{o.signal, o.slow, {}, {}, o.value, {}, o.sigma.values()};
    for (std::size_t i = 0; i < o.size(); ++i) {
      y.from.push_back(o.slow ? grid[o.first[i]] : 0.5 * (grid[o.first[i]] + grid[o.last[i]]));
      y.t.push_back(o.slow ? grid[o.last[i]] : y.from.back());
      y.simulated.push_back(o.value[i] - all[s].value[static_cast<Eigen::Index>(i)] * o.sigma[i]);
    }
    list.push_back(std::move(y));
  }
  return list;
}

}  // namespace emtb
