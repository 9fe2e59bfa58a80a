#include "session/resolution.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <random>

namespace emtb {
namespace {

double resolution_of(const std::vector<double>& values, bool may_be_set = true) {
  const std::span<const double> piece(values);
  return resolution({&piece, 1}, may_be_set);
}

/// A converter of that step behind a noisy signal that runs over `range`, printed with so many significant digits.
std::vector<double> converted(double step, double range, std::size_t count, const char* format) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> noise(0, 1.5 * step);
  std::vector<double> values;
  for (std::size_t i = 0; i < count; ++i) {
    const double truth =
        range * std::sin(0.5 + 3.0 * static_cast<double>(i) / static_cast<double>(count)) + noise(random);
    char text[32];
    std::snprintf(text, sizeof text, format, step * std::round(truth / step));
    values.push_back(std::atof(text));
  }
  return values;
}

TEST(Resolution, IsTheStepOfATwelveBitConverter) {
  const double step = 260.0 / 4096;
  EXPECT_NEAR(resolution_of(converted(step, 110, 60000, "%.17g")), step, 1e-4 * step);
}

TEST(Resolution, SurvivesTheRoundingOfTheTextFile) {
  const double step = 260.0 / 4096;  // 5 digits: 104.49 instead of 104.4873
  EXPECT_NEAR(resolution_of(converted(step, 110, 60000, "%.5g")), step, 1e-3 * step);
  const double fine = 10.0 / 4096;  // 17.346 instead of 17.34619: rounded by up to a fifth of a step
  EXPECT_NEAR(resolution_of(converted(fine, 20, 60000, "%.5g")), fine, 1e-3 * fine);
}

TEST(Resolution, ShowsInASlowMeterAtRestToo) {
  EXPECT_NEAR(resolution_of(converted(0.001, 0, 40, "%.6f")), 0.001, 1e-6);
}

TEST(Resolution, IsUnknownForValuesThatLieOnNoGrid) {
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise;
  std::vector<double> values(5000);
  for (double& v : values) v = noise(random);
  EXPECT_EQ(resolution_of(values), 0);
  values.resize(30);
  EXPECT_EQ(resolution_of(values), 0);
}

TEST(Resolution, TheLevelsOfAStaircaseAreNoGrid) {
  std::vector<double> values;
  for (int level = 0; level <= 24; ++level) values.insert(values.end(), 1000, 0.25 * level);
  EXPECT_EQ(resolution_of(values), 0);
}

TEST(Resolution, OfACoarseInstrumentWithoutNoiseIsToldByTheFewChangesOfWhatNobodySets) {
  std::vector<double> current;  // two inrushes in a file of 8 digits: 0 to 5 steps and back, then nothing for long
  for (int inrush = 0; inrush < 2; ++inrush) {
    for (const int level : {0, 4, 5, 4, 3, 2, 1, 0, -4, -5, -4, -3, -2, -1}) {
      current.insert(current.end(), level == 0 ? 1000 : 30, std::round(17.9262137e6 * level) / 1e6);
    }
  }
  EXPECT_NEAR(resolution_of(current, false), 17.9262137, 1e-4);
  EXPECT_EQ(resolution_of(current, true), 0);
}

TEST(Resolution, OfAnEncoderThatTurnsFastBetweenReadingsIsToldByGapsOfManySteps) {
  constexpr double step = 2 * std::numbers::pi / 1731;
  const std::vector<int> counts{0,    7,    16,   28,   43,   61,   83,   108,  137,  170, 206, 246,
                                290,  337,  388,  443,  501,  563,  629,  698,  771,  848, 929, 1013,
                                1101, 1193, 1289, 1388, 1491, 1598, 1709, 1823, 1941, 2063};
  std::vector<double> values;
  for (const int c : counts) values.push_back(std::round(step * c * 1e5) * 1e-5);
  EXPECT_NEAR(resolution_of(values), step, 1e-5 * step);
}

TEST(Resolution, IsUnknownForAConstantAndForNothing) {
  EXPECT_EQ(resolution_of(std::vector<double>(1000, 3.0)), 0);
  EXPECT_EQ(resolution_of({}), 0);
  EXPECT_EQ(resolution({}, true), 0);
}

TEST(Resolution, SurvivesALastDigitThatSplitsItsCodes) {
  // The angle of an encoder of 44 lines, within a turn: the same code comes by different sums.
  std::vector<double> angles;
  for (int k = 0; k < 2000; ++k) {
    const double counts = std::floor(0.7 * k + 0.001 * k * k);
    angles.push_back(1e-7 * std::round(1e7 * std::fmod(2 * std::numbers::pi / 44 * counts, 2 * std::numbers::pi)));
  }
  EXPECT_NEAR(resolution_of(angles, false), 2 * std::numbers::pi / 44, 1e-6);
}

}  // namespace
}  // namespace emtb
