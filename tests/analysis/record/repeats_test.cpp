#include "analysis/record/repeats.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <vector>

namespace emtb {
namespace {

using testing::ElementsAre;

/// A reading that is updated every so many rows, from some row on.
Series written(std::size_t rows, std::size_t first) {
  Series series;
  double shown = 0;
  for (std::size_t k = 0; k < 400; ++k) {
    if (k % rows == first) shown = std::sin(0.1 * static_cast<double>(k));
    series.t.push_back(1e-3 * static_cast<double>(k));
    series.value.push_back(shown);
  }
  return series;
}

TEST(Repeats, AreToldByTheRowsAtWhichASignalChanges) {
  std::size_t first = 0;
  EXPECT_EQ(rows_an_update(written(4, 3).value, &first), 4U);
  EXPECT_EQ(first, 3U);
  EXPECT_EQ(rows_an_update(written(1, 0).value), 1U);
}

TEST(Repeats, OfACoarseInstrumentAreReadings) {
  Series coarse = written(1, 0);
  for (double& v : coarse.value.edit()) v = std::round(8 * v) / 8;
  EXPECT_EQ(rows_an_update(coarse.value), 1U);
  EXPECT_EQ(updates_of(coarse).value.size(), coarse.value.size());
}

TEST(Repeats, CountOnce) {
  const Series updates = updates_of(written(3, 1));
  EXPECT_EQ(updates.value.size(), 133U);
  EXPECT_THAT(std::vector(updates.t.begin(), updates.t.begin() + 3),
              ElementsAre(testing::DoubleEq(1e-3), testing::DoubleEq(4e-3), testing::DoubleEq(7e-3)));
  EXPECT_DOUBLE_EQ(updates.value[2], std::sin(0.7));
}

TEST(Repeats, AreStraightBetweenUpdates) {
  Series held;
  for (int k = 0; k < 400; ++k) {
    held.t.push_back(1e-3 * k);
    const int updated = k - k % 4;
    held.value.push_back(updated + (updated % 8 == 0 ? 0.5 : 0));
  }
  const Series straight = straight_between_updates(held);
  EXPECT_EQ(straight.t, held.t);
  EXPECT_EQ(straight.value[8], 8.5);
  EXPECT_NEAR(straight.value[10], 10.25, 1e-9);
  EXPECT_EQ(straight.value[12], 12);
  EXPECT_EQ(straight.value[399], held.value[399]) << "nobody knows what came then";
}

/// A motor that runs up and down, in steps of an instrument; a row brings a new reading, or the last one again.
/// @param share of the rows that bring one
Series driven(double share) {
  std::mt19937 random(4);
  std::bernoulli_distribution is_read(share);
  Series series;
  double shown = 0, speed = 0;
  for (int k = 0; k < 1500; ++k) {
    speed += 0.02 * ((k / 250 % 2 == 0 ? 1000 : 200) - speed);
    if (is_read(random)) shown = std::round(speed);
    series.t.push_back(1e-2 * k);
    series.value.push_back(shown);
  }
  return series;
}

TEST(Repeats, AtNoFixedRateAreToldWhereTheSignalMoves) {
  EXPECT_TRUE(repeats_unevenly(driven(0.4).value));
  EXPECT_FALSE(repeats_unevenly(driven(1).value));
  Series steps = driven(1);
  for (std::size_t k = 0; k < steps.value.size(); ++k) steps.value.edit()[k] = k / 5 % 7 < 3 ? 100 : 20;
  EXPECT_FALSE(repeats_unevenly(steps.value)) << "edges are no motion";
}

TEST(Repeats, AtNoFixedRateCountOnceAndStandAtAboutTheUsualRate) {
  const Series logged = driven(0.4), updates = readings_of(logged);
  EXPECT_LT(updates.value.size(), 0.6 * static_cast<double>(logged.value.size()));
  EXPECT_GT(updates.value.size(), 0.2 * static_cast<double>(logged.value.size()));
  for (std::size_t k = 1; k < updates.t.size(); ++k) {
    const auto row = static_cast<std::size_t>(std::lround(updates.t[k] / 1e-2));
    ASSERT_TRUE(logged.value[row] != logged.value[row - 1] || updates.t[k] - updates.t[k - 1] > 0.035) << row;
  }
}

TEST(Repeats, TooFewToTellAreLeft) { EXPECT_EQ(rows_an_update(std::vector<double>(100, 1.0)), 1U); }

}  // namespace
}  // namespace emtb
