#include "analysis/numerics/statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

namespace emtb {

double chi_squared_tail(double x, std::ptrdiff_t degrees_of_freedom) {
  if (x <= 0) return 1;
  const bool odd = degrees_of_freedom % 2 == 1;
  double tail = odd ? std::erfc(std::sqrt(x / 2)) : std::exp(-x / 2);
  double term = odd ? std::sqrt(2 * x / std::numbers::pi) * std::exp(-x / 2) : x / 2 * std::exp(-x / 2);
  for (std::ptrdiff_t k = odd ? 3 : 4; k <= degrees_of_freedom; k += 2) {
    tail += term;
    term *= x / static_cast<double>(k);
  }
  return tail;
}

double normal_quantile(double tail) {
  double low = 0, high = 40;      // standard deviations; erfc is 0 in doubles from 38 on
  for (int i = 0; i < 80; ++i) {  // halvings: down to the last bit of a double
    const double middle = 0.5 * (low + high);
    (0.5 * std::erfc(middle / std::sqrt(2.0)) > tail ? low : high) = middle;
  }
  return low;
}

double median(std::vector<double> x) {
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::ranges::nth_element(x, middle);
  return *middle;
}

double robust_sigma(std::vector<double> sizes) {
  constexpr double sigma_per_median = 1.4826;  // 1/0.6745, the upper quartile of a standard normal
  return sigma_per_median * median(std::move(sizes));
}

}  // namespace emtb
