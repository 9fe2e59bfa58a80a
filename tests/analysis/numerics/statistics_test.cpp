#include "analysis/numerics/statistics.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace emtb {
namespace {

/// As tables of the chi-squared distribution print them (Abramowitz, Stegun, table 26.8).
TEST(ChiSquaredTail, AgreesWithTheTables) {
  struct Row {
    std::ptrdiff_t degrees_of_freedom;
    double at_10, at_5, at_1, at_01;  // x at a tail of 10, 5, 1 and 0.1 %
  };
  for (const Row& row : {Row{1, 2.70554, 3.84146, 6.63490, 10.828}, Row{2, 4.60517, 5.99146, 9.21034, 13.816},
                         Row{3, 6.25139, 7.81473, 11.3449, 16.266}, Row{4, 7.77944, 9.48773, 13.2767, 18.467},
                         Row{5, 9.23635, 11.0705, 15.0863, 20.515}, Row{10, 15.9872, 18.3070, 23.2093, 29.588},
                         Row{30, 40.2560, 43.7729, 50.8922, 59.703}}) {
    EXPECT_NEAR(chi_squared_tail(row.at_10, row.degrees_of_freedom), 0.1, 1e-6) << row.degrees_of_freedom;
    EXPECT_NEAR(chi_squared_tail(row.at_5, row.degrees_of_freedom), 0.05, 1e-6) << row.degrees_of_freedom;
    EXPECT_NEAR(chi_squared_tail(row.at_1, row.degrees_of_freedom), 0.01, 1e-6) << row.degrees_of_freedom;
    EXPECT_NEAR(chi_squared_tail(row.at_01, row.degrees_of_freedom), 0.001, 1e-6) << row.degrees_of_freedom;
  }
}

TEST(ChiSquaredTail, IsOneWhereNothingWasFound) {
  EXPECT_EQ(chi_squared_tail(0, 3), 1);
  EXPECT_EQ(chi_squared_tail(-1, 2), 1);
}

TEST(ChiSquaredTail, StaysExactFarOut) {
  EXPECT_NEAR(chi_squared_tail(400, 2) / std::exp(-200.0), 1, 1e-12);
  EXPECT_NEAR(chi_squared_tail(400, 1) / std::erfc(std::sqrt(200.0)), 1, 1e-12);
}

TEST(NormalQuantile, AgreesWithTheTables) {
  EXPECT_NEAR(normal_quantile(0.5), 0, 1e-12);
  EXPECT_NEAR(normal_quantile(0.158655254), 1, 1e-8);
  EXPECT_NEAR(normal_quantile(0.05), 1.644853627, 1e-9);
  EXPECT_NEAR(normal_quantile(0.025), 1.959963985, 1e-9);
  EXPECT_NEAR(normal_quantile(0.001), 3.090232306, 1e-9);
  EXPECT_NEAR(normal_quantile(2.866515719e-7), 5, 1e-8);
}

TEST(NormalQuantile, IsTheRootOfChiSquaredOfOneDegreeOfFreedom) {
  for (const double tail : {0.2, 0.05, 1e-3, 1e-6, 1e-12}) {
    const double x = normal_quantile(tail / 2);
    EXPECT_NEAR(chi_squared_tail(x * x, 1) / tail, 1, 1e-9) << tail;
  }
}

TEST(Median, IsTheMiddleAndOfAnEvenNumberTheUpperOfTwo) {
  EXPECT_EQ(median({7}), 7);
  EXPECT_EQ(median({9, 1, 5}), 5);
  EXPECT_EQ(median({4, 1, 3, 2}), 3);
}

TEST(RobustSigma, IsTheStandardDeviationWhateverAFewDo) {
  std::vector<double> sizes;  // of a standard normal: its quantiles, both tails alike
  for (int k = 0; k < 1000; ++k) sizes.push_back(normal_quantile((k + 0.5) / 2000));
  EXPECT_NEAR(robust_sigma(sizes), 1, 2e-3);
  for (int k = 0; k < 20; ++k) sizes[static_cast<std::size_t>(k)] = 1e6;
  EXPECT_NEAR(robust_sigma(sizes), 1, 0.02);
}

}  // namespace
}  // namespace emtb
