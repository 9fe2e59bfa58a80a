#include "analysis/numerics/line_fit.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

TEST(FitLine, GoesThroughPointsThatLieOnALine) {
  std::vector<LinePoint> points;
  for (const double x : {1.0, 2.0, 5.0, 9.0}) points.push_back({.x = x, .y = 3 - 2 * x});
  const LineFit exact = fit_line(points);
  EXPECT_NEAR(exact.slope, -2, 1e-12);
  EXPECT_NEAR(exact.intercept, 3, 1e-12);
  EXPECT_NEAR(exact.slope_error, 0, 1e-12);
  EXPECT_NEAR(exact.r_squared, 1, 1e-12);
}

TEST(FitLine, IsOrdinaryLeastSquaresWhereNoErrorsAreKnown) {
  // By hand: x mean 2, y mean 3, Sxx 2, Sxy 3; residuals 0.5, -1, 0.5 with one degree of freedom.
  const std::vector<LinePoint> points{{.x = 1, .y = 2}, {.x = 2, .y = 2}, {.x = 3, .y = 5}};
  const LineFit fit = fit_line(points);
  EXPECT_DOUBLE_EQ(fit.slope, 1.5);
  EXPECT_NEAR(fit.intercept, 0, 1e-12);
  EXPECT_NEAR(fit.scatter, std::sqrt(1.5), 1e-12);
  EXPECT_NEAR(fit.slope_error, std::sqrt(1.5 / 2), 1e-12);
  EXPECT_NEAR(fit.intercept_error, std::sqrt(1.5 * (1.0 / 3 + 4.0 / 2)), 1e-12);
  EXPECT_NEAR(fit.r_squared, 1 - 1.5 / 6, 1e-12);
}

/// Pearson's data with York's weights, the classic of lines with errors in both variables.
TEST(FitLine, AgreesWithYorkOnPearsonsData) {
  const double x[] = {0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4};
  const double y[] = {5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5};
  const double weight_x[] = {1000, 1000, 500, 800, 200, 80, 60, 20, 1.8, 1};
  const double weight_y[] = {1, 1.8, 4, 8, 20, 20, 70, 70, 100, 500};
  std::vector<LinePoint> points;
  for (std::size_t k = 0; k < 10; ++k) {
    points.push_back({x[k], y[k], 1 / std::sqrt(weight_x[k]), 1 / std::sqrt(weight_y[k]), 0});
  }
  const LineFit fit = fit_line(points);
  EXPECT_NEAR(fit.slope, -0.48053340745, 1e-9);
  EXPECT_NEAR(fit.intercept, 5.47991022403, 1e-8);
  const double widened = std::sqrt(11.8663531941 / 8);  // chi2 of eight degrees of freedom
  EXPECT_NEAR(fit.slope_error, 0.057985 * widened, 2e-5);
  EXPECT_NEAR(fit.intercept_error, 0.294971 * widened, 1e-4);
}

TEST(FitLine, StatesErrorsThatCoverWhereBothCoordinatesErrTogether) {
  int inside = 0, all = 0;
  for (unsigned seed = 1; seed <= 400; ++seed) {
    synthetic::Noise noise(seed);
    std::vector<LinePoint> points;
    for (int k = 0; k < 8; ++k) {
      const double common = noise(1), own = noise(1), other = noise(1);
      LinePoint p{.x = 10.0 * k, .y = 5 + 0.7 * 10 * k, .sigma_x = 1, .sigma_y = 0.5, .correlation = 0.8};
      p.x += 0.8 * common + 0.6 * own;
      p.y += 0.5 * (common + 0 * other);
      points.push_back(p);
    }
    const LineFit fit = fit_line(points);
    inside += std::abs(fit.slope - 0.7) < 1.96 * fit.slope_error;
    inside += std::abs(fit.intercept - 5) < 1.96 * fit.intercept_error;
    all += 2;
  }
  EXPECT_GT(inside, 0.92 * all);
  EXPECT_LT(inside, 0.995 * all);
}

TEST(FitLine, RefusesWhatIsNoLine) {
  EXPECT_THROW(fit_line(std::vector<LinePoint>{{.x = 1, .y = 1}, {.x = 2, .y = 2}}), SessionError);
  EXPECT_THROW(fit_line(std::vector<LinePoint>{{.x = 1, .y = 1}, {.x = 1, .y = 2}, {.x = 1, .y = 3}}), SessionError);
}

}  // namespace
}  // namespace emtb
