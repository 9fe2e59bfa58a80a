#include "analysis/numerics/real_transform.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "analysis/numerics/parallel.h"

namespace emtb {
namespace {

std::vector<double> some_series(std::size_t n) {
  std::vector<double> x;
  for (std::size_t j = 0; j < n; ++j) x.push_back(std::sin(0.3 * static_cast<double>(j * j)) + 0.2);
  return x;
}

double largest_error(RealTransform& transform, std::size_t n) {
  const std::vector<double> x = some_series(n);
  const auto transformed = transform.of(x);
  double worst = 0;
  for (std::size_t k = 0; k <= n / 2; ++k) {
    std::complex<double> sum;
    for (std::size_t j = 0; j < n; ++j) {
      const double turns = static_cast<double>(j * k % n) / static_cast<double>(n);
      sum += x[j] * std::polar(1.0, -2 * std::numbers::pi * turns);
    }
    worst = std::max(worst, std::abs(transformed[k] - sum));
  }
  return worst;
}

TEST(RealTransform, IsTheSumThatItStandsFor) {
  RealTransform transform;
  for (const std::size_t n : {8U, 64U, 60U, 64U, 45U, 8U}) EXPECT_LT(largest_error(transform, n), 1e-12) << n;
}

TEST(RealTransform, ServesManyThreads) {
  RealTransforms transforms;
  std::vector<double> errors(32, 1.0);
  parallel_for(errors.size(), [&](std::size_t i) {
    errors[i] = transforms.with_one([&](RealTransform& one) { return largest_error(one, 32 << i % 4); });
  });
  for (const double error : errors) EXPECT_LT(error, 1e-11);
}

}  // namespace
}  // namespace emtb
