#include "daemon/safety.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace emtb {
namespace {

constexpr Limits reference{.min = 0, .max = 6, .safe = 0};

Safety safety(double rate = 0) { return Safety({.omega = 190, .i_a = 2, .torque = 0.8, .time = 120}, reference, rate); }

Reading reading(Signal signal, double value) { return {.signal = signal, .time = 1, .value = value, .sequence = 0}; }

TEST(Safety, StartsLatchedAndArmsOnlyWithoutACause) {
  Safety latch = safety();
  EXPECT_FALSE(latch.armed());
  EXPECT_EQ(latch.cause().fault, Fault::none);
  latch.arm();
  EXPECT_TRUE(latch.armed());
  latch.trip({Fault::over_speed, Signal::omega, 200});
  EXPECT_FALSE(latch.armed());
  latch.arm();
  EXPECT_FALSE(latch.armed()) << "a cause stands";
  latch.clear();
  EXPECT_FALSE(latch.armed()) << "forgetting is not arming";
  latch.arm();
  EXPECT_TRUE(latch.armed());
}

TEST(Safety, KeepsTheFirstCause) {
  Safety latch = safety();
  EXPECT_TRUE(latch.trip({Fault::over_speed, Signal::omega, 200}));
  EXPECT_FALSE(latch.trip({Fault::client_lost, {}, 0}));
  EXPECT_EQ(latch.cause().fault, Fault::over_speed);
  EXPECT_EQ(latch.cause().value, 200);
}

TEST(Safety, JudgesReadingsByTheBenchsLimitsOfEitherSign) {
  const Safety latch = safety();
  EXPECT_EQ(latch.judge(reading(Signal::omega, 190)).fault, Fault::none);
  EXPECT_EQ(latch.judge(reading(Signal::omega, 190.1)).fault, Fault::over_speed);
  EXPECT_EQ(latch.judge(reading(Signal::omega, -190.1)).fault, Fault::over_speed);
  EXPECT_EQ(latch.judge(reading(Signal::i_a, -2.1)).fault, Fault::over_current);
  EXPECT_EQ(latch.judge(reading(Signal::torque, 0.81)).fault, Fault::over_torque);
  EXPECT_EQ(latch.judge(reading(Signal::e_a, 1e6)).fault, Fault::none);
  EXPECT_EQ(latch.judge_run_time(120).fault, Fault::none);
  EXPECT_EQ(latch.judge_run_time(120.1).fault, Fault::run_too_long);
}

TEST(Safety, AReadingThatIsNoNumberIsAFaultOnAnySignal) {
  const Safety latch = safety();
  for (const Signal signal : all_signals()) {
    for (const double bad : {std::nan(""), std::numeric_limits<double>::infinity()}) {
      EXPECT_EQ(latch.judge(reading(signal, bad)).fault, Fault::non_finite);
    }
  }
}

TEST(Safety, AnAbsentLimitIsNotChecked) {
  const Safety latch({}, reference, 0);
  EXPECT_EQ(latch.judge(reading(Signal::omega, 1e9)).fault, Fault::none);
  EXPECT_EQ(latch.judge_run_time(1e9).fault, Fault::none);
}

TEST(Safety, ClampsTheReference) {
  const Safety latch = safety();
  EXPECT_EQ(latch.shape(8, 0, 1e-3), 6);
  EXPECT_EQ(latch.shape(-1, 0, 1e-3), 0);
  EXPECT_EQ(latch.shape(3, 0, 1e-3), 3);
  for (const double bad :
       {std::nan(""), std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()}) {
    EXPECT_EQ(latch.shape(bad, 3, 1e-3), 0) << "not finite: safe";
  }
}

TEST(Safety, LimitsTheRateBothWays) {
  const Safety latch = safety(2);  // [V/s]
  EXPECT_DOUBLE_EQ(latch.shape(6, 1, 0.1), 1.2);
  EXPECT_DOUBLE_EQ(latch.shape(0, 1, 0.1), 0.8);
  EXPECT_DOUBLE_EQ(latch.shape(1.1, 1, 0.1), 1.1);
  EXPECT_DOUBLE_EQ(latch.shape(6, 1, -5), 1) << "time that runs backwards moves nothing";
}

}  // namespace
}  // namespace emtb
