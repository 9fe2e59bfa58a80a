#include "analysis/fit/at_bound.h"

#include <cmath>

namespace emtb {

bool rests_on_bound(const Parameter& p, double pull, double scale) {
  constexpr double no_difference = 1e-6;  // of the scale: no decision hangs on so little
  constexpr double clear = 1;  // standard errors: a descent ends with a pull, where a direction is flat to either side
  if (!std::isfinite(scale)) scale = std::abs(p.value);
  const double near = no_difference * scale, strength = pull * scale;
  return (p.value - p.min <= near && strength <= clear) || (p.max - p.value <= near && strength >= -clear);
}

}  // namespace emtb
