#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <vector>

#include "daemon/loop.h"
#include "daemon/recorder.h"
#include "tests/faulty_device.h"

namespace emtb::loop_bench {

inline constexpr double period = 1e-3;  // [s]
inline const BenchConfig::SafetyLimits limits{.omega = 190, .i_a = 2, .torque = 0.8, .time = 5};

/// A loop on a bench of fakes, ticked by the test.
class LoopTest : public testing::Test {
 protected:
  explicit LoopTest(std::size_t ring_size = 1 << 16, Loop::Settings settings = {})
      : ring(ring_size), loop(faulty.bench, complete(settings), mailbox, live, ring) {
    loop.start();
  }

  static Loop::Settings complete(Loop::Settings settings) {
    settings.limits = limits;
    settings.reference = {.min = 0, .max = 6, .safe = 0};
    settings.period = period;
    return settings;
  }

  void tick(int times = 1) {
    for (int i = 0; i < times; ++i) {
      if (loop.wanted()) loop.prepare();
      faulty.clock->sleep_until(faulty.clock->now() + period);
      loop.tick(faulty.clock->now());
    }
  }

  void reset() {
    ++mailbox.resets;
    tick(2);
  }

  /// Armed, and a run of 3 V for 1 s on, 0.1 s of it gone.
  void run(Profile profile = Profile("level", {{0, 3}, {1, 3}})) {
    reset();
    ASSERT_EQ(live.state, LoopState::armed);
    orders.push_back(std::make_unique<Order>(Order{orders.size() + 1, std::move(profile)}));
    mailbox.run = orders.back().get();
    tick(100);
  }

  /// Everything that came out of the ring.
  std::vector<Record>& records() {
    ring.consume_all([this](const Record& record) { records_.push_back(record); });
    return records_;
  }
  std::vector<Record> of(Record::Kind kind) {
    std::vector<Record> some;
    for (const Record& record : records()) {
      if (record.kind == kind) some.push_back(record);
    }
    return some;
  }
  std::vector<Record> samples(Signal signal) {
    std::vector<Record> some;
    for (const Record& record : of(Record::Kind::sample)) {
      if (record.signal == signal) some.push_back(record);
    }
    return some;
  }

  void expect_latched_by(Fault fault) {
    EXPECT_EQ(live.state, LoopState::latched);
    EXPECT_EQ(live.fault, fault) << text(live.fault);
    EXPECT_EQ(faulty.output->volts, 0) << "the reference must be safe";
  }

  /// The run's end record, after the time for the last readings.
  void expect_ended(Outcome outcome, Fault fault) {
    tick(200);
    EXPECT_FALSE(loop.busy());
    const auto ends = of(Record::Kind::end);
    ASSERT_EQ(ends.size(), 1u);
    EXPECT_EQ(ends[0].outcome, outcome);
    EXPECT_EQ(ends[0].code, static_cast<int>(fault));
  }

  FaultyBench faulty;
  Mailbox mailbox;
  Live live;
  Ring ring;
  std::vector<std::unique_ptr<Order>> orders;
  std::vector<Record> records_;
  Loop loop;
};

}  // namespace emtb::loop_bench
