#include "daemon/trace.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

namespace emtb {
namespace {

using nlohmann::json;

class TraceOfABench : public testing::Test {
 protected:
  /// Samples of the speed at 1 kHz, of the reference with them, and of a slow meter.
  void measure(double from, double to) {
    for (int tick = static_cast<int>(std::lround(from * 1e3)); tick < std::lround(to * 1e3); ++tick) {
      const double t = tick * 1e-3;
      trace.take(Signal::u_ref, t, 1);
      trace.take(Signal::omega, t, tick == 1234 ? 99 : std::sin(t));
      if (tick % 400 == 0) trace.take(Signal::i_a, t, tick);
      if (tick % 500 == 0) empty();
    }
    empty();
  }
  void empty() {
    while (trace.work()) {
    }
  }
  json block(std::uint64_t client = 1) {
    const std::string line = trace.block(client);
    return line.empty() ? json() : json::parse(line)["params"];
  }

  Trace trace{
      {{.signal = Signal::omega, .period = 1e-3, .source = ""}, {.signal = Signal::i_a, .period = 0.4, .source = ""}},
      1000};
};

TEST_F(TraceOfABench, GivesEverySampleOnceToWhoAsksForAll) {
  measure(0, 0.1);
  EXPECT_TRUE(block().is_null()) << "nobody follows";
  trace.follow(1, 0);
  EXPECT_TRUE(block().is_null()) << "from now on";
  measure(0.1, 0.2);
  const json all = block();
  EXPECT_EQ(all["dropped"], 0);
  ASSERT_EQ(all["signals"]["omega"]["t"].size(), 100u);
  EXPECT_NEAR(all["signals"]["omega"]["t"][7], 0.107, 1e-9);
  EXPECT_NEAR(all["signals"]["omega"]["value"][7], std::sin(0.107), 1e-6);
  EXPECT_TRUE(block().is_null());
  measure(0.2, 0.21);
  EXPECT_EQ(block()["signals"]["omega"]["t"].size(), 10u);
}

TEST_F(TraceOfABench, ABinKeepsThePeakThatNoScreenWouldShow) {
  trace.follow(1, 0.1);
  measure(1, 2);
  json bins = block()["signals"]["omega"];
  ASSERT_EQ(bins["t"].size(), 9u) << "the last one is not over";
  EXPECT_NEAR(bins["t"][2], 1.25, 1e-9);
  EXPECT_EQ(bins["max"][2], 99);
  EXPECT_NEAR(bins["min"][2], std::sin(1.2), 1e-6);
  EXPECT_NEAR(bins["last"][2], std::sin(1.299), 1e-6);
}

TEST_F(TraceOfABench, ASlowMetersReadingDoesNotWaitForItsNext) {
  trace.follow(1, 0.02);
  measure(0, 0.05);
  EXPECT_EQ(block()["signals"]["i_a"]["t"].size(), 1u);
}

TEST_F(TraceOfABench, CountsWhatAFollowerDidNotGetInTime) {
  trace.follow(1, 0);
  measure(0, 20);
  std::size_t got = 0;
  std::uint64_t dropped = 0;
  for (json some = block(); !some.is_null(); some = block()) {
    dropped += some["dropped"].get<std::uint64_t>();
    for (const auto& [name, signal] : some["signals"].items()) {
      EXPECT_LE(signal["t"].size(), Trace::most_at_once);
      got += signal["t"].size();
    }
  }
  EXPECT_GT(dropped, 0u);
  EXPECT_EQ(got + dropped, 20000u + 20000u + 50u);
}

TEST_F(TraceOfABench, CountsWhatTheLoopCouldNotHandOver) {
  trace.follow(1, 0);
  for (int n = 0; n < 100000; ++n) trace.take(Signal::omega, n * 1e-5, 0);  // nobody empties
  empty();
  std::uint64_t dropped = 0;
  for (json some = block(); !some.is_null(); some = block()) dropped += some["dropped"].get<std::uint64_t>();
  EXPECT_GT(dropped, 90000u);
}

TEST_F(TraceOfABench, RemembersTenMinutesAndMoreWithEveryPeak) {
  measure(0, 700);
  for (const double last : {10.0, 60.0, 600.0}) {
    const json history = trace.history(last, 100);
    const json& omega = history["signals"]["omega"];
    EXPECT_LE(omega["t"].size(), 101u);
    EXPECT_GE(omega["t"].size(), 50u);
    EXPECT_NEAR(omega["t"].front(), 700 - last, 2 * history["bin"].get<double>());
    EXPECT_NEAR(omega["t"].back(), 700, 2 * history["bin"].get<double>());
  }
  const json all = trace.history(700, 100)["signals"]["omega"]["max"];
  EXPECT_EQ(all[0], 99) << "of 700 s, one sample";
}

TEST_F(TraceOfABench, AClockThatBeginsAnewBeginsAHistory) {
  measure(100, 110);
  measure(0, 2);
  const json omega = trace.history(60, 100)["signals"]["omega"];
  EXPECT_LT(omega["t"].back(), 2.5);
  EXPECT_GE(omega["t"].front(), 0);
}

TEST_F(TraceOfABench, AnAnswerIsNeverLargerThanAClientMayLeaveUnread) {
  measure(0, 600);
  EXPECT_LT(trace.history(600, 2000).dump().size(), std::size_t{256} * 1024);
}

}  // namespace
}  // namespace emtb
