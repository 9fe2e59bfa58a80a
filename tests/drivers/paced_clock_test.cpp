#include "drivers/simulated/paced_clock.h"

#include <gtest/gtest.h>

#include <atomic>
#include <limits>
#include <thread>

namespace emtb::simulated {
namespace {

TEST(PacedClock, RunsAtItsPace) {
  const MonotonicClock machine;
  for (const double pace : {1.0, 10.0, 0.5}) {
    PacedClock clock(pace);
    const double machine_start = machine.now();
    const double start = clock.now();
    clock.sleep_until(start + 0.05 * pace);
    const double took = machine.now() - machine_start;
    EXPECT_GE(clock.now() - start, 0.05 * pace);
    EXPECT_GE(took, 0.0499);
    EXPECT_LE(clock.now() - start, pace * (machine.now() - machine_start + 1e-3));
  }
}

TEST(PacedClock, AsFastAsPossibleStepsExactlyAndDoesNotSleep) {
  const MonotonicClock machine;
  PacedClock clock(PacedClock::as_fast_as_possible);
  const double machine_start = machine.now();
  const double start = clock.now();
  EXPECT_EQ(clock.now(), start) << "time stands still between the steps";
  for (int n = 1; n <= 100'000; ++n) {
    clock.sleep_until(start + n * 1e-3);
    ASSERT_EQ(clock.now(), start + n * 1e-3);
  }
  EXPECT_LT(machine.now() - machine_start, 10) << "100 s";
  clock.sleep_until(start);
  EXPECT_EQ(clock.now(), start + 100) << "never backwards";
}

TEST(PacedClock, TimeGoesOnWhenThePaceChanges) {
  PacedClock clock(1);
  double before = clock.now();
  for (int n = 0; n < 300; ++n) {
    clock.set_pace(n % 3 == 0 ? 0 : n % 3 == 1 ? 1 : 1000);
    if (n % 3 == 0) clock.sleep_until(clock.now() + 0.01);
    const double now = clock.now();
    ASSERT_GE(now, before);
    ASSERT_LT(now, before + 10);
    before = now;
  }
}

TEST(PacedClock, IsContinuousForOthersWhileThePaceChanges) {
  PacedClock clock(1);
  std::atomic<bool> done = false;
  std::thread changer([&] {
    for (int n = 0; n < 20'000; ++n) clock.set_pace(n % 2 == 0 ? 1000 : 0);
    clock.set_pace(1);
    done = true;
  });
  double before = clock.now();
  while (!done) {
    const double now = clock.now();
    ASSERT_GE(now, before);
    before = now;
    if (before < 0) break;
  }
  changer.join();
}

TEST(PacedClock, ASleeperNoticesANewPace) {
  const MonotonicClock machine;
  PacedClock clock(1);
  const double start = machine.now();
  std::thread changer([&] {
    MonotonicClock().sleep_until(start + 0.03);
    clock.set_pace(PacedClock::as_fast_as_possible);
  });
  clock.sleep_until(clock.now() + 1000);
  changer.join();
  EXPECT_LT(machine.now() - start, 5);
}

TEST(PacedClock, TakesNonsenseAsRealTime) {
  PacedClock clock(-3);
  EXPECT_EQ(clock.pace(), 1);
  clock.set_pace(std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(clock.pace(), 1);
  clock.set_pace(20);
  EXPECT_EQ(clock.pace(), 20);
}

}  // namespace
}  // namespace emtb::simulated
