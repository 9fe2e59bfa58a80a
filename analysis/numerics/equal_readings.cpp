#include "analysis/numerics/equal_readings.h"

namespace emtb {

std::vector<EqualReadings> equal_readings(std::span<const double> x) {
  std::vector<EqualReadings> all;
  for (std::size_t k = 0; k < x.size(); ++k) {
    if (k == 0 || x[k] != x[k - 1]) all.push_back({k, k, x[k]});
    all.back().end = k + 1;
  }
  return all;
}

}  // namespace emtb
