#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numeric>
#include <thread>

#include "drivers/simulated/daq.h"
#include "drivers/simulated/manual_clock.h"
#include "drivers/simulated/meter.h"
#include "drivers/simulated/output.h"
#include "hal/error.h"
#include "tests/drivers/servo.h"

namespace emtb::simulated {
namespace {

constexpr std::uint64_t seed = 7;

PlantParameters servo_and_driver() {
  PlantParameters p = servo();
  p.driver = {.gain = 4, .rise = 2000, .fall = 2000, .min = -24, .max = 24};
  return p;
}

/// A channel that tells the truth.
DaqChannel exact(Signal signal) { return {.signal = signal, .bits = 0}; }

/// A servo, a card, and the loop that reads it.
struct Rig {
  explicit Rig(std::vector<DaqChannel> channels, double now = 1000, std::uint64_t world_seed = seed)
      : clock(std::make_shared<ManualClock>(now)),
        world(std::make_shared<World>(servo_and_driver(), clock, world_seed)),
        daq("daq", world, std::move(channels), tick),
        output(world, {.min = -6, .max = 6, .safe = 0}) {}

  /// Sets, reads, and waits for the next tick, as the loop does.
  std::vector<Reading> turn(double reference) {
    output.set(reference);
    std::vector<Reading> readings(daq.channels().size());
    readings.resize(daq.read(readings).count);
    start = std::isnan(start) ? clock->now() : start;
    clock->sleep_until(start + static_cast<double>(++ticks) * tick);
    return readings;
  }
  void begin() {
    daq.start();
    start = std::numeric_limits<double>::quiet_NaN();
    ticks = 0;
  }
  /// Values of the first channel.
  std::vector<double> record(int count, double reference) {
    std::vector<double> values;
    for (int n = 0; n < count; ++n) values.push_back(turn(reference)[0].value);
    return values;
  }

  std::shared_ptr<ManualClock> clock;
  std::shared_ptr<World> world;
  Daq daq;
  Output output;
  double start = std::numeric_limits<double>::quiet_NaN();
  std::uint64_t ticks = 0;
};

double sigma(const std::vector<double>& x) {
  const double mean = std::accumulate(x.begin(), x.end(), 0.0) / static_cast<double>(x.size());
  double sum = 0;
  for (const double value : x) sum += (value - mean) * (value - mean);
  return std::sqrt(sum / static_cast<double>(x.size()));
}

double correlation(const std::vector<double>& x, std::size_t lag) {
  double sum = 0;
  for (std::size_t n = lag; n < x.size(); ++n) sum += x[n] * x[n - lag];
  return sum / static_cast<double>(x.size() - lag) / (sigma(x) * sigma(x));
}

TEST(Converter, HasItsStepsAndItsEnds) {
  const DaqChannel channel{.signal = Signal::e_a, .low = -130, .high = 130, .bits = 12};
  EXPECT_DOUBLE_EQ(channel.lsb(), 260.0 / 4096);
  EXPECT_EQ(quantise(channel, 0), 0);
  EXPECT_EQ(quantise(channel, 0.49 * channel.lsb()), 0);
  EXPECT_DOUBLE_EQ(quantise(channel, 0.51 * channel.lsb()), channel.lsb());
  EXPECT_DOUBLE_EQ(quantise(channel, -1e9), -130);
  EXPECT_DOUBLE_EQ(quantise(channel, 1e9), 130 - channel.lsb());
  for (double v = -129; v < 129; v += 0.37) {
    EXPECT_LE(std::abs(quantise(channel, v) - v), channel.lsb() / 2 + 1e-12);
    EXPECT_NEAR(std::remainder(quantise(channel, v), channel.lsb()), 0, 1e-9);
  }
}

TEST(Noise, HasItsSigmaAndIsWhite) {
  Noise noise(0.3, 0, 1);
  std::vector<double> x(100'000);
  for (double& value : x) value = noise.next();
  EXPECT_NEAR(sigma(x), 0.3, 0.003);
  for (const std::size_t lag : {1U, 2U, 10U}) EXPECT_NEAR(correlation(x, lag), 0, 0.015);
}

TEST(Noise, ColouredKeepsItsSigmaAndDecaysGeometrically) {
  Noise noise(0.3, 0.9, 1);
  std::vector<double> x(400'000);
  for (double& value : x) value = noise.next();
  EXPECT_NEAR(sigma(x), 0.3, 0.005);
  EXPECT_NEAR(correlation(x, 1), 0.9, 0.01);
  EXPECT_NEAR(correlation(x, 5), std::pow(0.9, 5), 0.02);
}

TEST(Noise, IsGaussian) {
  Noise noise(1, 0, 1);
  int within = 0;
  int beyond = 0;
  for (int n = 0; n < 100'000; ++n) {
    const double value = std::abs(noise.next());
    within += value < 1 ? 1 : 0;
    beyond += value > 3 ? 1 : 0;
  }
  EXPECT_NEAR(within, 68'270, 500);
  EXPECT_NEAR(beyond, 270, 60);
}

TEST(Noise, StreamsDoNotMeet) {
  EXPECT_NE(stream(1, 0, "daq omega"), stream(2, 0, "daq omega"));
  EXPECT_NE(stream(1, 0, "daq omega"), stream(1, 1, "daq omega"));
  EXPECT_NE(stream(1, 0, "daq omega"), stream(1, 0, "daq e_a"));
}

TEST(Daq, DescribesItsChannels) {
  const Rig rig({{.signal = Signal::omega, .low = -625, .high = 625}, exact(Signal::theta)});
  ASSERT_EQ(rig.daq.channels().size(), 2U);
  EXPECT_EQ(rig.daq.channels()[0].signal, Signal::omega);
  EXPECT_DOUBLE_EQ(rig.daq.channels()[0].lsb, 1250.0 / 4096);
  EXPECT_DOUBLE_EQ(rig.daq.channels()[0].period, tick);
  EXPECT_DOUBLE_EQ(rig.daq.channels()[0].window, 0);
  EXPECT_NE(rig.daq.channels()[0].source.find("daq"), std::string::npos);
}

TEST(Daq, GivesEachChannelOnceATick) {
  Rig rig({exact(Signal::u_ref), exact(Signal::omega)});
  rig.begin();
  for (std::uint64_t n = 0; n < 10; ++n) {
    const auto readings = rig.turn(2);
    ASSERT_EQ(readings.size(), 2U);
    EXPECT_EQ(readings[0].signal, Signal::u_ref);
    EXPECT_EQ(readings[1].signal, Signal::omega);
    EXPECT_NEAR(readings[1].time, 1000 + static_cast<double>(n) * tick, 1e-9);
    EXPECT_EQ(readings[1].sequence, n);
  }
}

TEST(Daq, HandsTheRestOverNextTime) {
  Rig rig({exact(Signal::u_ref), exact(Signal::omega), exact(Signal::e_a)});
  std::array<Reading, 2> out{};
  ASSERT_EQ(rig.daq.read(out).count, 2U);
  ASSERT_EQ(rig.daq.read(out).count, 1U);
  EXPECT_EQ(out[0].signal, Signal::e_a);
  EXPECT_EQ(out[0].sequence, 0U);
  ASSERT_EQ(rig.daq.read(out).count, 2U);
  EXPECT_EQ(out[0].sequence, 1U);
}

TEST(Daq, AReferenceActsFromTheTickThatSetItOn) {
  Rig rig({exact(Signal::u_ref), exact(Signal::e_a)});
  rig.begin();
  for (int n = 0; n < 5; ++n) rig.turn(0);
  auto readings = rig.turn(6);
  EXPECT_EQ(readings[0].value, 6);
  EXPECT_EQ(readings[1].value, 0) << "the driver has had no time yet";
  readings = rig.turn(6);
  EXPECT_NEAR(readings[1].value, 2, 1e-9) << "2000 V/s for one tick";
}

TEST(Daq, ASensorMayBeOffItsCalibration) {
  Rig rig({{.signal = Signal::u_ref, .bits = 0, .gain = 0.745, .offset = 0.1}});
  EXPECT_NEAR(rig.turn(2)[0].value, 0.745 * 2 + 0.1, 1e-12);
}

TEST(Daq, NoiseIsAsDeclared) {
  Rig rig({{.signal = Signal::omega, .low = -625, .high = 625, .noise = 0.6, .correlation = 0.8}});
  rig.begin();
  const auto x = rig.record(100'000, 0);
  const double lsb = 1250.0 / 4096;
  EXPECT_NEAR(sigma(x), std::sqrt(0.6 * 0.6 + lsb * lsb / 12), 0.015);
  EXPECT_NEAR(correlation(x, 1), 0.8 * 0.36 / (0.36 + lsb * lsb / 12), 0.02);
}

TEST(Daq, RefusesWhatThePlantDoesNotHave) {
  EXPECT_THROW(Rig({exact(Signal::i_f)}), ConfigError);
  EXPECT_THROW(Rig({exact(Signal::temperature)}), ConfigError);
  EXPECT_THROW(Rig({exact(Signal::armature_open)}), ConfigError);
}

TEST(Recording, IsTheSameInEveryProcessWheneverItIsMade) {
  const std::vector<DaqChannel> channels{{.signal = Signal::omega, .low = -625, .high = 625, .noise = 0.3}};
  const auto two_runs = [&](double start) {
    Rig rig(channels, start);
    std::vector<double> all;
    for (int run = 0; run < 2; ++run) {
      rig.begin();
      const auto values = rig.record(3000, 3);
      all.insert(all.end(), values.begin(), values.end());
      rig.record(3000, 0);                                     // the motor stops
      rig.clock->sleep_until(rig.clock->now() + start / 777);  // and waits for the next run
    }
    return all;
  };
  const auto here = two_runs(1000);
  EXPECT_EQ(here, two_runs(1000));
  EXPECT_EQ(here, two_runs(86'400.123456789));
}

TEST(Recording, EachHasItsOwnNoise) {
  Rig rig({{.signal = Signal::omega, .low = -625, .high = 625, .noise = 1}});
  rig.begin();
  const auto first = rig.record(100, 0);
  rig.begin();
  EXPECT_NE(first, rig.record(100, 0));
  Rig other({{.signal = Signal::omega, .low = -625, .high = 625, .noise = 1}}, 1000, seed + 1);
  other.begin();
  EXPECT_NE(first, other.record(100, 0));
}

TEST(Recording, StartRestartsSampleNumbersAndEmptiesTheBuffer) {
  Rig rig({exact(Signal::u_ref), exact(Signal::omega)});
  std::array<Reading, 1> one{};
  rig.daq.read(one);
  rig.daq.read(one);
  rig.daq.read(one);  // the second sample, half of it still waiting
  rig.daq.start();
  rig.daq.read(one);
  EXPECT_EQ(one[0].signal, Signal::u_ref);
  EXPECT_EQ(one[0].sequence, 0U);
}

TEST(Plants, AgeWhileNobodyLooks) {
  Rig rig({exact(Signal::omega)});
  rig.turn(3);
  rig.clock->sleep_until(rig.clock->now() + 10);
  const double settled = rig.turn(3)[0].value;
  EXPECT_NEAR(settled, 282, 2);  // 12 V over 0.042 V s/rad, less friction
}

class MeterTest : public ::testing::Test {
 protected:
  /// Reads everything that the meter gives in `seconds`, at a tick of 1 ms, and the true current at 0.1 ms.
  void measure(const MeterSettings& settings, double seconds) {
    Meter meter("meter", rig.world, settings);
    rig.daq.start();
    meter.start();
    const double start = rig.clock->now();
    for (int n = 0; n <= std::lround(seconds / 1e-4); ++n) {
      const double t = n * 1e-4;
      rig.clock->sleep_until(start + t);
      rig.output.set(t < 0.33 ? 2 : 3);
      Reading reading;
      rig.daq.read({&reading, 1});
      current.push_back(reading.value);
      if (n % 10 != 0) continue;
      const Readings got = meter.read({&reading, 1});
      EXPECT_EQ(got.fault, Fault::none);
      if (got.count == 1) {
        reading.time -= start;
        readings.push_back(reading);
        arrived.push_back(t);
      }
    }
  }
  /// [A] by Simpson's rule on the true current, which is smooth but for its corner at 0.33 s.
  double mean(double t0, double t1) const {
    double sum = 0;
    for (auto n = std::lround(t0 / 1e-4); n < std::lround(t1 / 1e-4); n += 2) {
      const auto k = static_cast<std::size_t>(n);
      sum += (current[k] + 4 * current[k + 1] + current[k + 2]) / 3 * 1e-4;
    }
    return sum / (t1 - t0);
  }
  Rig rig{{exact(Signal::i_a)}};
  std::vector<double> current;
  std::vector<Reading> readings;
  std::vector<double> arrived;
};

TEST_F(MeterTest, AveragesExactlyItsWindow) {
  measure({.period = 0.4, .window = 0.4, .resolution = 0}, 2.05);
  ASSERT_EQ(readings.size(), 5U);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const double end = 0.4 * static_cast<double>(k + 1);
    EXPECT_NEAR(readings[k].time, end, 1e-9);
    EXPECT_EQ(readings[k].sequence, k);
    EXPECT_EQ(readings[k].signal, Signal::i_a);
    EXPECT_NEAR(readings[k].value, mean(end - 0.4, end), 2e-5);
  }
  EXPECT_GT(readings[0].value, readings[4].value);
}

TEST_F(MeterTest, MayRestBetweenItsWindows) {
  measure({.period = 0.4, .window = 0.1, .resolution = 0}, 1.25);
  ASSERT_EQ(readings.size(), 3U);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const double end = 0.4 * static_cast<double>(k + 1);
    EXPECT_NEAR(readings[k].time, end, 1e-9);
    EXPECT_NEAR(readings[k].value, mean(end - 0.1, end), 2e-5);
  }
}

TEST_F(MeterTest, MayReadTheRootMeanSquare) {
  measure({.period = 0.4, .window = 0.4, .resolution = 0, .rms = true}, 2.05);
  ASSERT_EQ(readings.size(), 5U);
  for (double& i : current) i *= i;
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const double end = 0.4 * static_cast<double>(k + 1);
    EXPECT_NEAR(readings[k].value, std::sqrt(mean(end - 0.4, end)), 2e-5);
  }
}

TEST_F(MeterTest, ShowsItsDigits) {
  measure({.resolution = 0.001}, 2.05);
  for (const Reading& reading : readings) EXPECT_NEAR(std::remainder(reading.value, 0.001), 0, 1e-12);
}

TEST_F(MeterTest, ItsReadingsMayArriveLate) {
  measure({.latency = 0.05}, 1.7);
  ASSERT_EQ(readings.size(), 4U);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    EXPECT_NEAR(readings[k].time, 0.4 * static_cast<double>(k + 1), 1e-9);
    EXPECT_NEAR(arrived[k], readings[k].time + 0.05, 1.1e-3);
  }
}

TEST(Meter, DescribesItself) {
  Rig rig({exact(Signal::u_ref)});
  const Meter meter("meter", rig.world, {.period = 0.4, .window = 0.3, .resolution = 0.001});
  ASSERT_EQ(meter.channels().size(), 1U);
  EXPECT_EQ(meter.channels()[0].signal, Signal::i_a);
  EXPECT_DOUBLE_EQ(meter.channels()[0].period, 0.4);
  EXPECT_DOUBLE_EQ(meter.channels()[0].window, 0.3);
  EXPECT_DOUBLE_EQ(meter.channels()[0].lsb, 0.001);
}

TEST(Meter, IsSilentBeforeItStartsAndLosesTheOldestWhenNobodyReads) {
  Rig rig({exact(Signal::u_ref)});
  Meter meter("meter", rig.world, {.period = 0.1, .window = 0.1});
  std::array<Reading, 32> out{};
  rig.clock->sleep_until(rig.clock->now() + 1);
  EXPECT_EQ(meter.read(out).count, 0U);
  meter.start();
  EXPECT_EQ(meter.read(out).count, 0U);
  rig.clock->sleep_until(rig.clock->now() + 2.05);
  ASSERT_EQ(meter.read(out).count, 16U);
  EXPECT_EQ(out[0].sequence, 4U) << "a jump is a gap";
  EXPECT_EQ(out[15].sequence, 19U);
}

TEST(Meter, RefusesAWindowLongerThanItsPeriod) {
  Rig rig({exact(Signal::u_ref)});
  EXPECT_THROW(Meter("m", rig.world, {.period = 0.4, .window = 0.5}), ConfigError);
  EXPECT_THROW(Meter("m", rig.world, {.period = 0.4, .window = 0}), ConfigError);
}

TEST(Output, StartsSafe) {
  Rig rig({exact(Signal::u_ref)});
  Output output(rig.world, {.min = 1, .max = 6, .safe = 1.5});
  EXPECT_EQ(rig.world->reference(), 1.5);
}

TEST(Output, ClampsBelowEveryCaller) {
  Rig rig({exact(Signal::u_ref)});
  EXPECT_EQ(rig.output.set(7), Fault::none);
  EXPECT_EQ(rig.world->reference(), 6);
  EXPECT_EQ(rig.output.set(-1e300), Fault::none);
  EXPECT_EQ(rig.world->reference(), -6);
  EXPECT_EQ(rig.output.limits().max, 6);
}

TEST(Output, RefusesWhatIsNoNumberAndGoesSafe) {
  Rig rig({exact(Signal::u_ref)});
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                           -std::numeric_limits<double>::infinity()}) {
    rig.output.set(3);
    EXPECT_EQ(rig.output.set(bad), Fault::non_finite);
    EXPECT_EQ(rig.world->reference(), 0);
  }
}

TEST(Output, GoesSafeFromAnyThread) {
  Rig rig({exact(Signal::u_ref)});
  std::thread other([&] {
    for (int n = 0; n < 1000; ++n) rig.output.make_safe();
  });
  for (int n = 0; n < 1000; ++n) {
    std::array<Reading, 1> out{};
    rig.daq.read(out);
    rig.output.set(3);
  }
  other.join();
  EXPECT_EQ(rig.output.make_safe(), Fault::none);
  EXPECT_EQ(rig.world->reference(), 0);
}

}  // namespace
}  // namespace emtb::simulated
