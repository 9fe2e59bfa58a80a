#include "analysis/numerics/even_series.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace emtb {

double mean_interval(std::span<const double> t) { return (t.back() - t.front()) / static_cast<double>(t.size() - 1); }

double jitter_of(std::span<const double> t) {
  const double interval = mean_interval(t);
  double squares = 0;
  for (std::size_t k = 1; k < t.size(); ++k) squares += std::pow(t[k] - t[k - 1] - interval, 2);
  return std::sqrt(squares / 2 / static_cast<double>(t.size() - 1));
}

double last_digit_of(std::span<const double> t) {
  constexpr double close = 1e-4, finest = 1e-7;
  const auto are_whole = [&](double digit) {
    return std::ranges::all_of(t, [&](double at) { return std::abs(at / digit - std::round(at / digit)) < close; });
  };
  double digit = 1;
  while (digit > finest && !are_whole(digit)) digit /= 10;
  return digit;
}

EvenLine even_line(std::span<const double> y) {
  const auto n = static_cast<double>(y.size());
  const double middle = (n - 1) / 2;
  double mean = 0, slope = 0;
  for (std::size_t i = 0; i < y.size(); ++i) mean += y[i] / n;
  const double spread = n * (n * n - 1) / 12;  // sum of the squares of i - middle
  for (std::size_t i = 0; i < y.size(); ++i) slope += (static_cast<double>(i) - middle) * (y[i] - mean) / spread;
  double squares = 0, products = 0, before = 0;
  for (std::size_t i = 0; i < y.size(); ++i) {
    const double r = y[i] - mean - slope * (static_cast<double>(i) - middle);
    squares += r * r;
    if (i > 0) products += r * before;
    before = r;
  }
  return {.variance = squares / (n - 2),
          .covariance = products / (n - 2),
          .rise = std::abs(slope) * n,
          .before = mean - slope * (middle + 1)};
}

}  // namespace emtb
