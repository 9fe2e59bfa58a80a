#include "drivers/simulated/scanning_daq.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "drivers/simulated/manual_clock.h"
#include "tests/drivers/servo.h"

namespace emtb::simulated {
namespace {

/// A card with a clock of its own in a loop of 1 kHz.
struct ScanningRig {
  explicit ScanningRig(const CardClock& card_clock)
      : clock(std::make_shared<ManualClock>(1000)),
        world(std::make_shared<World>(servo(), clock, 7)),
        daq("daq", world, {{.signal = Signal::u_ref, .bits = 0}, {.signal = Signal::omega, .bits = 0}}, 1e-3,
            card_clock) {
    daq.start();
  }
  std::vector<Reading> listen(double seconds) {
    std::vector<Reading> all;
    std::vector<Reading> some(64);
    const double start = clock->now();
    for (int tick = 1; tick <= seconds * 1000; ++tick) {
      const Readings got = daq.read(some);
      all.insert(all.end(), some.begin(), some.begin() + static_cast<std::ptrdiff_t>(got.count));
      clock->sleep_until(start + tick * 1e-3);
    }
    return all;
  }

  std::shared_ptr<ManualClock> clock;
  std::shared_ptr<World> world;
  ScanningDaq daq;
};

TEST(ScanningDaq, SaysHowItsClockRuns) {
  for (const double ppm : {-70.0, 0.0, 40.0}) {
    ScanningRig rig({.ppm = ppm});
    rig.listen(60);
    const auto estimate = rig.daq.own_clock();
    ASSERT_TRUE(estimate);
    EXPECT_NEAR(estimate->fast, ppm * 1e-6, 3e-6);
    EXPECT_LT(estimate->std_error, 3e-6);
  }
}

TEST(ScanningDaq, ScansAtTheRateOfItsOwnClock) {
  ScanningRig rig({.ppm = 500, .jitter = 0});
  const auto readings = rig.listen(20);
  EXPECT_NEAR(static_cast<double>(readings.size()) / 2, 20'000 + 10, 6) << "a fast clock takes more";
}

TEST(ScanningDaq, ReadingsAreNumberedAndTheirTimesGrow) {
  ScanningRig rig({.ppm = 40});
  const auto readings = rig.listen(5);
  ASSERT_GT(readings.size(), 9900U);
  for (std::size_t i = 2; i < readings.size(); ++i) {
    ASSERT_EQ(readings[i].sequence, i / 2);
    ASSERT_EQ(readings[i].signal, i % 2 == 0 ? Signal::u_ref : Signal::omega);
    ASSERT_GT(readings[i].time, readings[i - 2].time);
  }
}

TEST(ScanningDaq, ATimeIsThatOfTheSampleNotOfItsArrival) {
  ScanningRig rig({.ppm = 40, .block = 0.02, .jitter = 1e-3});
  rig.listen(30);
  const double before = rig.clock->now();
  rig.world->set_reference(1);
  for (const Reading& reading : rig.listen(0.5)) {
    if (reading.signal != Signal::u_ref || std::abs(reading.time - before) < 1e-3) continue;
    EXPECT_EQ(reading.value, reading.time > before ? 1 : 0) << "the step lies where it was, to one sample";
  }
}

TEST(ScanningDaq, ScansThatNobodyReadsForLongAreAGap) {
  ScanningRig rig({.ppm = 0});
  const auto before = rig.listen(1);
  rig.clock->sleep_until(rig.clock->now() + 10);
  const auto after = rig.listen(1);
  EXPECT_GT(after.front().sequence, before.back().sequence + 7000);
  EXPECT_NEAR(after.front().time - before.back().time, 8, 1) << "and its time is right";
}

TEST(ScanningDaq, BeginsAnewWithEachRecording) {
  ScanningRig rig({.ppm = 40});
  rig.listen(20);
  rig.daq.start();
  const auto readings = rig.listen(0.1);
  EXPECT_EQ(readings.front().sequence, 0U);
  EXPECT_TRUE(std::isinf(rig.daq.own_clock()->std_error)) << "what was known of the scan before";
}

}  // namespace
}  // namespace emtb::simulated
