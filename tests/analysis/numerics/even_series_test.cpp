#include "analysis/numerics/even_series.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "analysis/numerics/moments.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

TEST(MeanInterval, IsTheWholeOverTheGapsInIt) {
  EXPECT_DOUBLE_EQ(mean_interval(std::vector{2.0, 2.5}), 0.5);
  EXPECT_DOUBLE_EQ(mean_interval(std::vector{0.0, 0.9, 2.1, 3.0}), 1.0) << "whatever the clock jitters";
}

TEST(EvenLine, HasNoScatterOnALine) {
  std::vector<double> y;
  for (int k = 0; k < 10; ++k) y.push_back(3 - 2.0 * k);
  const EvenLine line = even_line(y);
  EXPECT_NEAR(line.variance, 0, 1e-24);
  EXPECT_NEAR(line.rise, 20, 1e-12);
  EXPECT_NEAR(line.before, 5, 1e-12);
}

TEST(EvenLine, IsTheLeastSquaresLine) {
  // By hand: mean 3, slope 1.5; residuals 0.5, -1, 0.5 with one degree of freedom.
  const EvenLine line = even_line(std::vector{2.0, 2.0, 5.0});
  EXPECT_NEAR(line.variance, 1.5, 1e-12);
  EXPECT_NEAR(line.covariance, -1, 1e-12);
  EXPECT_NEAR(line.rise, 4.5, 1e-12);
  EXPECT_NEAR(line.before, 0, 1e-12);
}

TEST(EvenLine, TellsTheMemoryOfNoiseWhateverTheDrift) {
  for (const double rho : {0.0, 0.6}) {
    std::vector<double> y = synthetic::coloured(20'000, rho, 3);
    for (std::size_t k = 0; k < y.size(); ++k) y[k] += 1e-3 * static_cast<double>(k);
    const EvenLine line = even_line(y);
    EXPECT_NEAR(line.variance, 1, 0.06) << rho;
    EXPECT_NEAR(line.covariance / line.variance, rho, 0.03) << rho;
  }
}

TEST(Moments, GiveTheLeastSquaresLine) {
  const std::vector<double> x{1, 2, 3}, y{2, 2, 5};
  const Moments m = moments_of(
      3, [&](std::size_t k) { return x[k]; }, [&](std::size_t k) { return y[k]; });
  EXPECT_DOUBLE_EQ(m.x_mean, 2);
  EXPECT_DOUBLE_EQ(m.y_mean, 3);
  EXPECT_DOUBLE_EQ(m.xx, 2);
  EXPECT_DOUBLE_EQ(m.yy, 6);
  EXPECT_NEAR(m.slope(), 1.5, 1e-12);
  EXPECT_NEAR(m.intercept(), 0, 1e-12);
}

}  // namespace
}  // namespace emtb
