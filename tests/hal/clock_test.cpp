#include "hal/clock.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(MonotonicClock, NeverRunsBackwards) {
  const MonotonicClock clock;
  double before = clock.now();
  for (int i = 0; i < 10'000; ++i) {
    const double now = clock.now();
    ASSERT_GE(now, before);
    before = now;
  }
}

TEST(MonotonicClock, SleepsUntilTheTimeHasCome) {
  MonotonicClock clock;
  for (int i = 0; i < 20; ++i) {
    const double until = clock.now() + 0.001 + 1e-7 * i;
    clock.sleep_until(until);
    EXPECT_GE(clock.now(), until);
  }
}

TEST(MonotonicClock, ATimeInThePastReturnsAtOnce) {
  MonotonicClock clock;
  const double start = clock.now();
  clock.sleep_until(start - 10);
  clock.sleep_until(-1);
  EXPECT_LT(clock.now() - start, 0.5);
}

}  // namespace
}  // namespace emtb
