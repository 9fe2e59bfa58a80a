#include "analysis/fit/typical_size.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/effect.h"

namespace emtb {
namespace {

/// [N m s/rad]
double damping_that_matters(const Model& model) {
  constexpr double second = 1;
  const std::vector<double> p = model.values();
  return model.input == Signal::i_a ? p[base::J] / second : p[base::K_b] * p[base::K_m] / p[base::R_a];
}

double size_of(const EffectParameter& known, double fitted, double start) {
  if (known.role == Role::phase) return std::numbers::pi;  // no angle is larger than another
  const bool from_null = known.role == Role::amplitude && std::isfinite(known.null);
  const double size = std::abs(fitted - (from_null ? known.null : 0));
  if (size > 0) return size;
  return known.typical > 0 ? known.typical : std::abs(start);
}

}  // namespace

double typical_size(const Model& fitted, const Model& start, std::size_t place) {
  const Parameter& p = fitted.at(place);
  const double started = place < start.names().size() ? std::abs(start.at(place).value) : 0;
  double size = std::abs(p.value);
  if (const EffectParameter* known = fitted.known_of(place)) {
    size = size_of(*known, p.value, started);
  } else if (p.min <= 0) {
    size = std::max(size, started);
    if (size == 0 && place == base::B) size = damping_that_matters(fitted);
  }
  return size > 0 ? size : 1;
}

double natural_size(const Model& fitted, const Model& start, std::size_t place) {
  const double size = typical_size(fitted, start, place);
  return place == base::B && fitted.at(place).min <= 0 ? std::max(size, damping_that_matters(fitted)) : size;
}

}  // namespace emtb
