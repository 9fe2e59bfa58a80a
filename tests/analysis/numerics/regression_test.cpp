#include "analysis/numerics/regression.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

TEST(Regression, SolvesWhatFitsExactly) {
  const std::vector<double> one{1, 1, 1, 1}, t{0, 1, 2, 3}, square{0, 1, 4, 9};
  const Regression fit = regress(std::array{one, t, square}, {2, 2.5, 4, 6.5});  // 2 + t²/2
  ASSERT_EQ(fit.value.size(), 3U);
  EXPECT_NEAR(fit.value[0], 2, 1e-12);
  EXPECT_NEAR(fit.value[1], 0, 1e-12);
  EXPECT_NEAR(fit.value[2], 0.5, 1e-12);
  EXPECT_NEAR(fit.r_squared, 1, 1e-12);
  EXPECT_NEAR(fit.scatter, 0, 1e-12);
  EXPECT_EQ(fit.rows, 4U);
}

TEST(Regression, StatesTheErrorsOfALineAsByHand) {
  // x mean 2, Sxx 2; residuals 0.5, -1, 0.5 with one degree of freedom.
  const Regression fit = regress(std::array{std::vector{1.0, 1.0, 1.0}, std::vector{1.0, 2.0, 3.0}}, {2, 2, 5});
  EXPECT_NEAR(fit.value[1], 1.5, 1e-12);
  EXPECT_NEAR(fit.scatter, std::sqrt(1.5), 1e-12);
  EXPECT_NEAR(fit.std_error[1], std::sqrt(1.5 / 2), 1e-12);
  EXPECT_NEAR(fit.std_error[0], std::sqrt(1.5 * (1.0 / 3 + 4.0 / 2)), 1e-12);
  EXPECT_NEAR(fit.r_squared, 1 - 1.5 / 6, 1e-12);
}

TEST(Regression, CountsARowByItsError) {
  const std::vector<double> one{1, 1, 1};
  const Regression mean = regress(std::array{one}, {0, 0, 10}, std::array{1.0, 1.0, 1000.0});
  EXPECT_NEAR(mean.value[0], 10 / (2e6 + 1), 1e-12);
  EXPECT_NEAR(mean.std_error[0], 1 / std::sqrt(2 + 1e-6), 1e-9) << "what the errors give: they explain what is left";
  const Regression doubtful = regress(std::array{one}, {0, 0, 10}, std::array{1.0, 1.0, 1.0});
  EXPECT_GT(doubtful.std_error[0], 3) << "widened: the errors do not explain what is left";
}

TEST(Regression, DoesNotMindColumnsOfVeryDifferentSize) {
  const std::vector<double> inertia{1e-6, 2e-6, -1e-6, 3e-6}, voltage{2e6, 1e6, 5e6, -1e6};
  std::vector<double> y;
  for (std::size_t k = 0; k < 4; ++k) y.push_back(4e5 * inertia[k] + 7e-7 * voltage[k]);
  const Regression fit = regress(std::array{inertia, voltage}, y);
  EXPECT_NEAR(fit.value[0] / 4e5, 1, 1e-9);
  EXPECT_NEAR(fit.value[1] / 7e-7, 1, 1e-9);
}

TEST(Regression, StatesErrorsThatCover) {
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    synthetic::Noise noise(seed);
    std::vector<double> a, b, y, sigma;
    for (int k = 0; k < 20; ++k) {
      a.push_back(std::sin(k));
      b.push_back(k % 3);
      sigma.push_back(0.1 * (1 + k % 2));
      y.push_back(2 * a.back() - 3 * b.back() + noise(sigma.back()));
    }
    const Regression fit = regress(std::array{a, b}, y, sigma);
    inside += std::abs(fit.value[0] - 2) < 1.96 * fit.std_error[0];
    inside += std::abs(fit.value[1] + 3) < 1.96 * fit.std_error[1];
    all += 2;
  }
  EXPECT_GT(inside, 0.92 * all);
  EXPECT_LT(inside, 0.99 * all);
}

TEST(Regression, NeedsMoreRowsThanColumns) {
  EXPECT_THROW(regress(std::array{std::vector{1.0, 2.0}, std::vector{1.0, 1.0}}, {1, 2}), SessionError);
}

}  // namespace
}  // namespace emtb
