#include "analysis/numerics/scatter.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

constexpr std::size_t many = 40'000;

/// A first-order autoregression of standard deviation 0.2, on something that moves.
std::vector<double> autoregression(double rho, const std::function<double(std::size_t)>& movement) {
  std::vector<double> x = synthetic::coloured(many, rho, 11);
  for (std::size_t k = 0; k < many; ++k) x[k] = movement(k) + 0.2 * x[k];
  return x;
}

double still(std::size_t) { return 0; }
double stairs(std::size_t k) { return 3.0 * static_cast<double>(k / 4000); }
double slope(std::size_t k) { return 1e-3 * static_cast<double>(k); }

TEST(ColouredNoise, IsFoundWhateverItsMemory) {
  for (const double rho : {0.0, 0.5, 0.9, 0.97}) {
    const ColouredNoise noise = coloured_noise(autoregression(rho, still), 0);
    EXPECT_NEAR(noise.sigma, 0.2, 0.02) << rho;
    EXPECT_NEAR(noise.autocorrelation, rho, 0.02) << rho;
  }
}

TEST(ColouredNoise, IsNotTakenInByEdgesAndSlopes) {
  for (const auto movement : {stairs, slope}) {
    const ColouredNoise noise = coloured_noise(autoregression(0.9, movement), 0);
    EXPECT_NEAR(noise.sigma, 0.2, 0.02);
    EXPECT_NEAR(noise.autocorrelation, 0.9, 0.02);
  }
}

TEST(ColouredNoise, IsNotTakenInByALoadThatComesAndGoes) {
  const auto back_and_forth = [](std::size_t k) { return (k / 300) % 2 == 0 ? 16.0 : -16.0; };
  const ColouredNoise noise = coloured_noise(autoregression(0, back_and_forth), 0);
  EXPECT_NEAR(noise.sigma, 0.2, 0.02);
  EXPECT_LT(noise.autocorrelation, 0.1);
}

TEST(ColouredNoise, IsNotTakenInByASeriesThatAlwaysMoves) {
  const auto swing = [](std::size_t k) { return 20 * std::sin(0.015 * static_cast<double>(k)); };
  EXPECT_LT(coloured_noise(autoregression(0, swing), 0).sigma, 2) << "no more than noise that walks off";
  const auto turns_back = [](std::size_t k) { return std::sin(0.06 * k) + std::sin(0.097 * k) < 0 ? -16.0 : 16.0; };
  EXPECT_NEAR(coloured_noise(autoregression(0, turns_back), 0).sigma, 0.2, 0.05);
}

TEST(ColouredNoise, IsNotTakenInByALoadThatMovesWithinTheLongestLag) {
  const auto load = [](std::size_t k) {
    const auto at = static_cast<double>(k);
    return 2.5 * (std::sin(0.031 * at) + std::sin(0.019 * at + 1) + std::sin(0.043 * at + 2));
  };
  const ColouredNoise noise = coloured_noise(autoregression(0, load), 0);
  EXPECT_NEAR(noise.sigma, 0.2, 0.15) << "within ten times of it, a walk of a hundred steps hid the load";
  EXPECT_LT(noise.of_mean(100), 0.2);
}

TEST(ColouredNoise, IsFoundBehindStepsAsLargeAsItself) {
  for (const double rho : {0.0, 0.7, 0.9}) {
    constexpr double step = 0.25;
    std::vector<double> x = autoregression(rho, stairs);
    for (double& v : x) v = step * std::round(v / step);
    const ColouredNoise noise = coloured_noise(x, step / std::sqrt(12.0));
    EXPECT_NEAR(noise.sigma, std::sqrt(0.04 + step * step / 12), 0.01) << rho;
    // The steps' own error is nearly white.
    EXPECT_NEAR(noise.autocorrelation, rho * 0.04 / (0.04 + step * step / 12), 0.05) << rho;
  }
}

TEST(ColouredNoise, IsNoLessThanTheInstrumentsStep) {
  const ColouredNoise noise = coloured_noise(std::vector<double>(100, 1.0), 0.05);
  EXPECT_EQ(noise.sigma, 0.05);
  EXPECT_EQ(noise.autocorrelation, 0);
}

TEST(ColouredNoise, FadesInMeansAsSlowlyAsItRemembers) {
  constexpr std::size_t width = 100;
  for (const double rho : {0.0, 0.9}) {
    const std::vector<double> x = autoregression(rho, still);
    double squares = 0;
    for (std::size_t begin = 0; begin < many; begin += width) {
      double mean = 0;
      for (std::size_t k = begin; k < begin + width; ++k) mean += x[k] / width;
      squares += mean * mean;
    }
    const double seen = std::sqrt(squares / (static_cast<double>(many) / width));
    EXPECT_NEAR((ColouredNoise{0.2, rho}.of_mean(width)), seen, 0.1 * seen) << rho;
  }
  EXPECT_EQ((ColouredNoise{0.2, 0.9}.of_mean(1)), 0.2);
}

TEST(DifferenceScatter, SeesNoiseBehindEdgesAndNoneInAReference) {
  synthetic::Noise noise(2);
  const Series edges = synthetic::series(1e-3, 5, [&](double t) { return 10 * std::floor(t) + noise(0.3); });
  EXPECT_NEAR(difference_scatter(edges.value), 0.3, 0.02);
  const Series reference = synthetic::series(1e-3, 5, [](double t) { return std::floor(t); });
  EXPECT_EQ(difference_scatter(reference.value), 0);
  EXPECT_EQ(difference_scatter(std::vector<double>{1}), 0);
}

}  // namespace
}  // namespace emtb
