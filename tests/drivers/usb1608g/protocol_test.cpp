#include "drivers/usb1608g/protocol.h"

#include <gmock/gmock.h>

#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "drivers/sample_clock.h"
#include "drivers/usb1608g/calibration.h"

namespace emtb::usb1608g {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;

TEST(Usb1608gProtocol, KnowsSixCards) {
  EXPECT_EQ(models().size(), 6U);
  ASSERT_NE(model_of(0x0136), nullptr);
  EXPECT_EQ(model_of(0x0136)->name, "USB-1608GX-2AO");
  EXPECT_EQ(model_of(0x0136)->outputs, 2);
  EXPECT_EQ(model_of(0x0110)->outputs, 0);
  EXPECT_EQ(model_of(0x00C4), nullptr) << "the USB-1208HS speaks otherwise";
}

TEST(Usb1608gProtocol, TheScanListMarksItsLastEntryAndIsAlwaysSentWhole) {
  const auto first = [](const Slot& slot) { return scan_list(std::array{slot})[0]; };
  EXPECT_EQ(first({.channel = 0, .wiring = Wiring::differential, .range = 0}), 0x80);
  EXPECT_EQ(first({.channel = 0, .wiring = Wiring::single_ended, .range = 0}), 0xA0);
  EXPECT_EQ(first({.channel = 9, .wiring = Wiring::single_ended, .range = 1}), 0xC9);
  EXPECT_EQ(first({.channel = 7, .wiring = Wiring::differential, .range = 3}), 0x9F);
  const auto three = scan_list(std::array{Slot{.channel = 0}, Slot{.channel = 1}, Slot{.channel = 2}});
  EXPECT_EQ(three.size(), 16U);
  EXPECT_EQ(three[0], 0x20);
  EXPECT_EQ(three[1], 0x21);
  EXPECT_EQ(three[2], 0xA2);
  EXPECT_THAT(std::span(three).subspan(3), Each(0));
}

TEST(Usb1608gProtocol, TheScanStartsWithFourteenBytesOrFifteen) {
  const std::uint32_t period = pacer_period(1000, 3, Pacer::scan);
  EXPECT_EQ(period, 63999U);
  EXPECT_THAT(scan_start({.period = period, .packet = 3}),
              ElementsAre(0, 0, 0, 0, 0, 0, 0, 0, 0xFF, 0xF9, 0, 0, 2, 0, 0));
  EXPECT_EQ(scan_start({.period = period, .packet = 3, .length = 14}).size(), 14U);
}

TEST(Usb1608gProtocol, ThePacerCountsScansOrConversions) {
  EXPECT_EQ(pacer_period(1000, 4, Pacer::conversion), 15999U);
  EXPECT_DOUBLE_EQ(scan_rate(15999, 4, Pacer::conversion), 1000);
  EXPECT_DOUBLE_EQ(scan_rate(63999, 4, Pacer::scan), 1000);
  const double achieved = scan_rate(pacer_period(7777, 1, Pacer::scan), 1, Pacer::scan);
  EXPECT_NE(achieved, 7777) << "the clock divides by whole numbers";
  EXPECT_NEAR(achieved, 7777, 0.5);
  EXPECT_EQ(pacer_period(1e9, 1, Pacer::scan), 1U) << "0 would be a clock from outside";
}

TEST(Usb1608gProtocol, FewSamplesComeInSmallPacketsOfWholeScansManyInFullOnes) {
  const Packing soon = pack(1000, 3, 0.002, 512);
  EXPECT_EQ(soon.packet, 6);
  EXPECT_EQ(soon.transfer, 512U);
  EXPECT_TRUE(soon.whole_scans);
  EXPECT_EQ(pack(100, 3, 0.002, 512).packet, 3) << "one scan at least";
  const Packing fast = pack(50e3, 8, 0.01, 512);
  EXPECT_EQ(fast.packet, 256);
  EXPECT_EQ(fast.transfer % 512, 0U);
  EXPECT_GT(fast.transfer, 4096U);
  EXPECT_LE(fast.transfer, 16384U);
  EXPECT_FALSE(fast.whole_scans);
  EXPECT_EQ(pack(1000, 8, 0.01, 64).packet, 32) << "a full-speed port";
}

TEST(Usb1608gProtocol, AConverterAtItsEndSaysSo) {
  EXPECT_TRUE(saturated(0));
  EXPECT_TRUE(saturated(0x60));
  EXPECT_FALSE(saturated(0x61));
  EXPECT_FALSE(saturated(0xFFFC));
  EXPECT_TRUE(saturated(0xFFFD));
}

std::array<std::uint8_t, 8> pair_of(float slope, float offset) {
  std::array<std::uint8_t, 8> bytes{};
  for (std::size_t k = 0; k < 8; ++k) {
    bytes[k] = static_cast<std::uint8_t>(std::bit_cast<std::uint32_t>(k < 4 ? slope : offset) >> (8 * (k % 4)));
  }
  return bytes;
}

TEST(Usb1608gCalibration, IsReadFromPairsOfFloats) {
  const auto read = correction(pair_of(1.01F, -12.5F), 0);
  ASSERT_TRUE(read);
  EXPECT_NEAR(read->slope, 1.01, 1e-7);
  EXPECT_EQ(read->offset, -12.5);
  EXPECT_FALSE(correction(pair_of(1, 0), 1)) << "the table ends before";
}

TEST(Usb1608gCalibration, WhatCannotBeTrueIsNotUsed) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(correction(pair_of(nan, 0), 0));
  EXPECT_FALSE(correction(pair_of(1, nan), 0));
  EXPECT_FALSE(correction(pair_of(0, 0), 0));
  EXPECT_FALSE(correction(pair_of(1.3F, 0), 0));
  EXPECT_FALSE(correction(pair_of(1, 1e5F), 0));
  EXPECT_FALSE(correction(std::array<std::uint8_t, 8>{255, 255, 255, 255, 255, 255, 255, 255}, 0)) << "erased";
}

TEST(Usb1608gCalibration, CodesAreVoltsAndBack) {
  EXPECT_EQ(volts_of(0x8000, {}, 10), 0);
  EXPECT_EQ(volts_of(0xC000, {}, 5), 2.5);
  EXPECT_EQ(volts_of(0, {}, 10), -10);
  EXPECT_GT(volts_of(0xFFFF, {.slope = 1.001, .offset = 10}, 10), 10) << "a correction may reach beyond";
  EXPECT_EQ(code_of(6, {}), 0xCCCD);
  EXPECT_EQ(code_of(0, {}), 0x8000);
  EXPECT_EQ(code_of(0, {.slope = 1, .offset = 3}), 0x8003);
  EXPECT_EQ(code_of(-11, {}), 0) << "never around the corner";
  EXPECT_EQ(code_of(11, {}), 0xFFFF);
}

TEST(SampleClockTest, FollowsTheEarliestArrivals) {
  SampleClock clock(1e-3);
  clock.arrived(0, 5.0005);
  std::mt19937 random(1);
  std::exponential_distribution<double> delay(1 / 2e-3);
  double worst = 0;
  double last = -1;
  for (std::uint64_t n = 0; n < 20000; ++n) {
    const double taken = 5 + static_cast<double>(n) * 1e-3 * (1 + 40e-6);  // a slow crystal
    clock.arrived(n, taken + (n % 5000 == 0 ? 0.3 : delay(random)));       // now and then the machine stalls
    const double time = clock.time_of(n);
    EXPECT_GT(time, last) << n;
    worst = std::max(worst, std::abs(time - taken));
    last = time;
  }
  EXPECT_LT(worst, 1e-3);
}

}  // namespace
}  // namespace emtb::usb1608g
