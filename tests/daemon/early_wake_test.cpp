#include "daemon/early_wake.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace emtb {
namespace {

TEST(EarlyWake, ComesToCoverAllButAboutOneSleepInAThousand) {
  EarlyWake early(1e-3);
  std::mt19937 random(1);
  std::lognormal_distribution<double> late(std::log(20e-6), 0.3);
  for (int i = 0; i < 50'000; ++i) early.slept(late(random));
  int beyond = 0;
  for (int i = 0; i < 100'000; ++i) {
    const double now = late(random);
    beyond += now > early.margin();
    early.slept(now);
  }
  EXPECT_GT(beyond, 20);
  EXPECT_LT(beyond, 400);
}

TEST(EarlyWake, TakesNoMoreThanAQuarterOfAPeriod) {
  EarlyWake early(100e-6);
  EXPECT_EQ(early.margin(), 0) << "nothing is known yet";
  for (int i = 0; i < 1000; ++i) early.slept(5e-3);
  EXPECT_DOUBLE_EQ(early.margin(), 25e-6);
}

TEST(EarlyWake, ForgetsAStallWithinSeconds) {
  EarlyWake early(1e-3);
  for (int i = 0; i < 10'000; ++i) early.slept(20e-6);
  early.slept(0.5);
  EXPECT_DOUBLE_EQ(early.margin(), 200e-6) << "the most";
  for (int i = 0; i < 30'000; ++i) early.slept(20e-6);
  EXPECT_LT(early.margin(), 25e-6);
}

}  // namespace
}  // namespace emtb
