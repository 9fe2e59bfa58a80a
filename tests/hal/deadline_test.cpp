#include "hal/deadline.h"

#include <gtest/gtest.h>

#include "tests/faulty_device.h"

namespace emtb {
namespace {

TEST(Deadline, DoesNotDriftHoweverLongACycleTakes) {
  FakeClock clock;
  const double start = clock.now();
  Deadline deadline(start, 1e-3);
  std::uint64_t missed = 0;
  for (int i = 0; i < 100'000; ++i) {
    clock.sleep_until(deadline.next());
    missed += deadline.woke(clock.now());
    clock.sleep_until(clock.now() + 0.7e-3);  // the cycle's work
  }
  EXPECT_EQ(missed, 0u);
  EXPECT_NEAR(deadline.next() - start, 100.001, 1e-9);
}

TEST(Deadline, SkipsMissedDeadlinesByWholePeriods) {
  Deadline deadline(0, 0.01);
  EXPECT_EQ(deadline.woke(0.010), 0u);
  EXPECT_EQ(deadline.woke(0.0550), 3u);  // due at 0.02; 0.03, 0.04 and 0.05 passed as well
  EXPECT_NEAR(deadline.next(), 0.06, 1e-12);
  EXPECT_EQ(deadline.woke(0.0601), 0u);
  EXPECT_NEAR(deadline.next(), 0.07, 1e-12);
}

TEST(Deadline, AStallThatEndsOnADeadlineLeavesTheNextOneAhead) {
  for (int periods = 1; periods < 2000; ++periods) {
    Deadline deadline(1000.123, 1e-3);
    const double now = 1000.123 + 1e-3 * periods;
    const auto missed = deadline.woke(now);
    EXPECT_NEAR(static_cast<double>(missed), periods - 1, 1);  // rounding may go either way
    EXPECT_GT(deadline.next(), now);
    EXPECT_LT(deadline.next(), now + 1.001e-3);
  }
}

TEST(Deadline, BeginsAnewAfterARestart) {
  Deadline deadline(0, 0.01);
  deadline.restart(5);
  EXPECT_NEAR(deadline.next(), 5.01, 1e-12);
  EXPECT_EQ(deadline.woke(5.0101), 0u);
}

}  // namespace
}  // namespace emtb
