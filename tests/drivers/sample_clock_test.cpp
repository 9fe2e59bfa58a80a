#include "drivers/sample_clock.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <functional>
#include <random>

namespace emtb {
namespace {

constexpr double scan_period = 1e-3;   // [s]
constexpr std::uint64_t in_block = 5;  // samples that come together

/// A device whose clock is fast by `fast`, and what we make of its samples.
struct Listening {
  double fast = 0;
  std::function<double(std::mt19937&)> delay;  // [s] of a block
  double tolerance = SampleClock::crystal;
  unsigned seed = 1;

  SampleClock clock{scan_period, tolerance};
  std::mt19937 random{seed};
  std::uint64_t next = 0;
  double taken_before = 1e5;  // [s] on our clock, of the sample before: up for a day
  double arrived_before = 0;  // [s]
  double worst_after = 0;     // [s] errors from here on are remembered
  double worst = 0;           // [s]

  void listen(double seconds) {
    for (const std::uint64_t end = next + static_cast<std::uint64_t>(seconds / scan_period); next < end;) {
      std::array<double, in_block> taken{};
      for (double& t : taken) t = taken_before += scan_period / (1 + fast);
      arrived_before = std::max(arrived_before, taken.back() + delay(random));  // blocks do not overtake each other
      clock.arrived(next + in_block - 1, arrived_before);
      for (const double t : taken) {
        const double error = std::abs(clock.time_of(next++) - t);
        if (static_cast<double>(next) * scan_period > worst_after) worst = std::max(worst, error);
      }
    }
  }
};

std::function<double(std::mt19937&)> exponential(double mean) {
  return [mean](std::mt19937& random) { return std::exponential_distribution<double>(1 / mean)(random); };
}

TEST(SampleClock, FindsByHowMuchTheDevicesClockIsFastOrSlow) {
  int covered = 0, asked = 0;
  for (const double fast : {-90e-6, -20e-6, 0.0, 3e-6, 50e-6}) {
    for (unsigned seed = 1; seed <= 10; ++seed) {
      Listening device{.fast = fast, .delay = exponential(1e-3), .seed = seed};
      device.listen(60);
      const ClockEstimate e = device.clock.estimate();
      EXPECT_NEAR(e.fast, fast, 4e-6) << seed;
      EXPECT_LT(e.std_error, 4e-6);
      EXPECT_NEAR(e.over, 60, 5);
      ++asked;
      if (std::abs(e.fast - fast) < 2 * e.std_error) ++covered;
    }
  }
  EXPECT_GE(covered, 0.9 * asked);
}

TEST(SampleClock, TellsHowFarTheClocksHaveComeApart) {
  Listening device{.fast = 50e-6, .delay = exponential(2e-4)};
  device.listen(10);
  const double at_first = device.clock.estimate().ahead;
  device.listen(100);
  EXPECT_NEAR(device.clock.estimate().ahead - at_first, 50e-6 * 100, 1e-4);
}

TEST(SampleClock, TimesFollowADriftingDeviceToAFewDelays) {
  for (const double fast : {-80e-6, 80e-6}) {
    Listening device{.fast = fast, .delay = exponential(2e-3), .worst_after = 20};
    device.listen(300);
    EXPECT_LT(device.worst, 0.2e-3) << "and the clocks came 24 ms apart";
  }
}

TEST(SampleClock, AStallOfTheMachineMovesNothing) {
  Listening device{.fast = 40e-6, .delay = exponential(5e-4), .worst_after = 20};
  device.listen(60);
  const auto usual = device.delay;
  for (int n = 0; n < 20; ++n) {
    device.delay = [](std::mt19937&) { return 0.4; };
    device.listen(0.005);
    device.delay = usual;
    device.listen(2);
  }
  EXPECT_LT(device.worst, 0.2e-3);
  EXPECT_NEAR(device.clock.estimate().fast, 40e-6, 3e-6);
}

TEST(SampleClock, ASecondOfALoadedMachineMovesLittle) {
  Listening device{.fast = 40e-6, .delay = exponential(2e-4), .worst_after = 20};
  device.listen(60);
  device.delay = [](std::mt19937& random) { return 0.02 + std::exponential_distribution<double>(200)(random); };
  device.listen(1);
  EXPECT_LT(device.worst, 0.2e-3) << "by 20 ms and more too late for a whole second";
}

TEST(SampleClock, AMachineThatIsBusyAtTheBeginningMisleadsNobody) {
  for (const double fast : {-40e-6, 40e-6}) {
    Listening device{.fast = fast, .delay = {}, .worst_after = 2};
    device.delay = [&](std::mt19937& random) {
      const double loaded = std::fmod(static_cast<double>(device.next) * scan_period, 30) < 1 ? 0.02 : 0;  // [s]
      return loaded + std::exponential_distribution<double>(5000)(random);
    };
    for (int n = 0; n < 100; ++n) {
      device.listen(1);
      const ClockEstimate e = device.clock.estimate();
      EXPECT_LT(std::abs(e.fast - fast), std::isinf(e.std_error) ? 1e-4 : 3 * e.std_error) << n << " s";
    }
    EXPECT_LT(device.worst, 0.2e-3);
  }
}

TEST(SampleClock, FollowsAClockThatWarmsUp) {
  Listening device{.fast = 20e-6, .delay = exponential(3e-4), .worst_after = 20};
  for (int minute = 0; minute < 30; ++minute) {
    device.listen(60);
    device.fast += 0.5e-6;
  }
  EXPECT_LT(device.worst, 0.3e-3);
  EXPECT_NEAR(device.clock.estimate().fast, 32e-6, 4e-6) << "the mean of the last minutes";
}

TEST(SampleClock, AResonatorIsFollowedAsWell) {
  Listening device{.fast = 4e-3, .delay = exponential(1e-3), .tolerance = SampleClock::resonator, .worst_after = 20};
  device.listen(120);
  EXPECT_NEAR(device.clock.estimate().fast, 4e-3, 5e-6);
  EXPECT_LT(device.worst, 0.2e-3);
}

TEST(SampleClock, ABusThatIsPolledHidesNothingButItsFrame) {
  constexpr double frame = 1e-3;  // [s] USB: nothing arrives between two
  Listening device{.fast = -12e-6, .delay = {}, .worst_after = 20};
  device.delay = [&](std::mt19937&) {
    const double ready = device.taken_before + 5e-5;
    return std::ceil(ready / frame) * frame - device.taken_before;
  };
  device.listen(600);
  EXPECT_LT(device.worst, frame + 0.2e-3);
  EXPECT_NEAR(device.clock.estimate().fast, -12e-6, 3e-6);
}

TEST(SampleClock, NothingIsKnownOfAFewPackets) {
  Listening device{.fast = 50e-6, .delay = exponential(1e-3)};
  device.listen(0.05);
  EXPECT_EQ(device.clock.estimate().over, 0);
  EXPECT_TRUE(std::isinf(device.clock.estimate().std_error));
}

TEST(SampleClock, NoDelayIsKnownExactly) {
  Listening device{.fast = 50e-6, .delay = [](std::mt19937&) { return 0.0; }, .worst_after = 2};
  device.listen(60);
  EXPECT_NEAR(device.clock.estimate().fast, 50e-6, 1e-7);
  EXPECT_LT(device.worst, 1e-5);
}

}  // namespace
}  // namespace emtb
