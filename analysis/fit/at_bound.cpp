#include "analysis/fit/at_bound.h"

#include <cmath>

namespace emtb {

bool rests_on_bound(const Parameter& p, double pull, double scale) {
  constexpr double no_difference = 1e-6;  // of the scale: no decision hangs on so little
  if (!std::isfinite(scale)) scale = std::abs(p.value);
  const double near = no_difference * scale;
  return (p.value - p.min <= near && pull <= 0) || (p.max - p.value <= near && pull >= 0);
}

}  // namespace emtb
