#include "daemon/lateness.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Lateness, TellsPercentilesWithinAnEighthOfAnOctave) {
  Lateness lateness;
  EXPECT_EQ(lateness.durations().percentile(0.5), 0);
  for (int us = 1; us <= 1000; ++us) lateness.add(us * 1e-6);
  EXPECT_NEAR(lateness.durations().percentile(0.5), 500e-6, 0.13 * 500e-6);
  EXPECT_NEAR(lateness.durations().percentile(0.99), 990e-6, 0.13 * 990e-6);
  EXPECT_DOUBLE_EQ(lateness.durations().max, 1000e-6);
  lateness.add(-1);  // woken early
  lateness.add(1e9);
  EXPECT_LE(lateness.durations().percentile(1), 1e9);
}

TEST(Lateness, TellsWhatCameSinceAnEarlierLook) {
  Lateness lateness;
  for (int i = 0; i < 100; ++i) lateness.add(5e-3);
  const Durations before = lateness.durations();
  EXPECT_EQ(before.since(before).total(), 0u);
  EXPECT_EQ(before.since(before).percentile(0.99), 0);
  for (int i = 0; i < 10; ++i) lateness.add(100e-6);
  const Durations later = lateness.durations().since(before);
  EXPECT_EQ(later.total(), 10u);
  EXPECT_NEAR(later.percentile(0.99), 100e-6, 13e-6);
  EXPECT_LT(later.max, 120e-6) << "the 5 ms were before";
}

}  // namespace
}  // namespace emtb
