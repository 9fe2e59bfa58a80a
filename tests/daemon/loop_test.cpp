#include "daemon/loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "session/session.h"
#include "tests/daemon/heap_guard.h"
#include "tests/daemon/loop_bench.h"

namespace emtb {
namespace {

using namespace loop_bench;

TEST_F(LoopTest, StartsLatchedAndSafe) {
  tick(10);
  expect_latched_by(Fault::none);
  EXPECT_EQ(faulty.output->sets, 0) << "nothing is set before somebody armed it";
  EXPECT_GE(faulty.output->safes, 1);
}

TEST_F(LoopTest, APauseHoldsTheReferenceUntilSomebodyConfirms) {
  reset();
  orders.push_back(
      std::make_unique<Order>(Order{1, Profile("p", {{0, 1}, {0.1, 1}, {0.1, 3}, {0.3, 3}}), {{0.1, "look", 1}}}));
  mailbox.run = orders.back().get();
  tick(500);
  EXPECT_EQ(live.state, LoopState::running);
  EXPECT_EQ(live.pause, 0);
  EXPECT_EQ(faulty.output->volts, 1) << "what stood before the step that comes at this very time";
  mailbox.confirmed = confirmation(1, 1);  // of another pause
  tick(100);
  EXPECT_EQ(live.pause, 0);
  mailbox.confirmed = confirmation(1, 0);
  tick(2);
  EXPECT_EQ(live.pause, -1);
  EXPECT_EQ(faulty.output->volts, 3);
  tick(150);
  EXPECT_EQ(live.state, LoopState::running) << "the profile has its full length yet";
  tick(60);
  expect_ended(Outcome::done, Fault::none);
}

TEST_F(LoopTest, APauseThatNobodyConfirmsEndsTheRun) {
  reset();
  orders.push_back(std::make_unique<Order>(Order{1, Profile("p", {{0, 1}, {1, 1}}), {{0.1, "look", 0.5}}}));
  mailbox.run = orders.back().get();
  tick(590);
  EXPECT_EQ(live.state, LoopState::running);
  tick(20);
  EXPECT_EQ(live.state, LoopState::armed);
  EXPECT_EQ(faulty.output->volts, 0);
  expect_ended(Outcome::stopped, Fault::none);
  const auto events = of(Record::Kind::event);
  ASSERT_EQ(events.size(), 2u);
  EXPECT_EQ(events[1].code, event_code::unattended);
}

TEST_F(LoopTest, ResetArmsWhereNoCauseStands) {
  reset();
  EXPECT_EQ(live.state, LoopState::armed);
  EXPECT_EQ(live.resets, 1u);
  tick(10);
  EXPECT_EQ(faulty.output->volts, 0);
}

TEST_F(LoopTest, ResetWaitsForEverySignalToBeThere) {
  faulty.meter->failure = Failure::stall;
  ++mailbox.resets;
  tick(100);
  EXPECT_EQ(live.state, LoopState::arming);
  EXPECT_EQ(live.resets, 0u) << "not decided yet";
  tick(300);
  expect_latched_by(Fault::stale_signal);
  EXPECT_EQ(live.resets, 1u);
}

TEST_F(LoopTest, ResetIsRefusedWhileTheCauseStands) {
  faulty.card->set(Signal::omega, 200);
  reset();
  expect_latched_by(Fault::over_speed);
  faulty.card->set(Signal::omega, 20);
  reset();
  EXPECT_EQ(live.state, LoopState::armed);
}

TEST_F(LoopTest, FollowsTheProfileAndRecordsWhatItSetAndRead) {
  faulty.card->set(Signal::omega, 42);
  run(Profile("steps", {{0, 1}, {0.5, 1}, {0.5, 4}, {1, 4}}));
  EXPECT_EQ(live.state, LoopState::running);
  EXPECT_EQ(faulty.output->volts, 1);
  tick(500);
  EXPECT_EQ(faulty.output->volts, 4);
  tick(500);
  EXPECT_EQ(faulty.output->volts, 0) << "safe at the end";
  EXPECT_EQ(live.state, LoopState::armed) << "a run that ended as planned needs no reset";
  expect_ended(Outcome::done, Fault::none);

  const auto u = samples(Signal::u_ref);
  ASSERT_EQ(u.size(), 1001u);
  EXPECT_EQ(u.front().t, 0);
  EXPECT_EQ(u.front().value, 1);
  EXPECT_NEAR(u.back().t, 1, 1e-9);
  EXPECT_EQ(u.back().value, 0);
  for (const Record& sample : u) EXPECT_EQ(sample.value, sample.t >= 1 - 1e-6 ? 0 : sample.t < 0.5 ? 1 : 4) << sample.t;
  const auto omega = samples(Signal::omega);
  ASSERT_EQ(omega.size(), 1001u);
  EXPECT_EQ(omega.back().value, 42);
  EXPECT_TRUE(of(Record::Kind::event).empty());
}

TEST_F(LoopTest, RecordsReadingsThatArriveLateAndNoneOfAfterTheRun) {
  faulty.meter->latency = 0.02;
  run();
  tick(900);
  expect_ended(Outcome::done, Fault::none);
  const auto i_a = samples(Signal::i_a);
  ASSERT_FALSE(i_a.empty());
  EXPECT_GE(i_a.front().t, 0) << "what the meter saw before the run is not of the run";
  EXPECT_NEAR(i_a.back().t, 1, 2e-3) << "what it saw at the end is";
  for (std::size_t i = 1; i < i_a.size(); ++i) EXPECT_GT(i_a[i].t, i_a[i - 1].t);
}

TEST_F(LoopTest, NotesGapsBySequenceNumbers) {
  run();
  faulty.card->skip = 7;
  tick(10);
  const auto events = of(Record::Kind::event);
  ASSERT_EQ(events.size(), 2u) << "one for each signal of the card";
  EXPECT_EQ(events[0].code, event_code::gap);
  EXPECT_EQ(events[0].value, 7);
  EXPECT_EQ(live.state, LoopState::running) << "a gap is no fault";
}

TEST_F(LoopTest, RefusesARunWhileLatchedAndStillSendsItsEnd) {
  Order order{7, Profile("level", {{0, 3}, {1, 3}})};
  mailbox.run = &order;
  tick(300);
  EXPECT_EQ(faulty.output->sets, 0);
  EXPECT_FALSE(loop.busy());
  ASSERT_EQ(of(Record::Kind::end).size(), 1u);
  EXPECT_EQ(of(Record::Kind::end)[0].outcome, Outcome::fault);
}

TEST_F(LoopTest, ClampsBelowEveryCaller) {
  run(Profile("mad", {{0, -50}, {0.5, 50}, {1, 50}}));
  tick(900);
  EXPECT_GE(faulty.output->lowest, 0);
  EXPECT_EQ(faulty.output->highest, 6);
}

TEST_F(LoopTest, StopEndsWhatWasAskedForBeforeIt) {
  run();
  ++mailbox.stops;
  tick();
  EXPECT_EQ(faulty.output->volts, 0);
  EXPECT_EQ(live.state, LoopState::armed);
  EXPECT_EQ(live.stops, 1u);
  EXPECT_EQ(live.stopped_run, 1u);
  expect_ended(Outcome::stopped, Fault::none);
}

TEST_F(LoopTest, ARunThatWasAskedForBeforeAStopNeverBegins) {
  reset();
  const Order stale{1, Profile("level", {{0, 3}, {1, 3}}), {}, mailbox.stops};
  ++mailbox.stops;
  tick();
  mailbox.run = &stale;
  tick(10);
  EXPECT_EQ(faulty.output->highest, 0);
  expect_ended(Outcome::stopped, Fault::none);
}

TEST_F(LoopTest, AStopHitsNoRunThatWasAskedForAfterIt) {
  reset();
  ++mailbox.stops;
  const Order order{1, Profile("level", {{0, 3}, {1, 3}}), {}, mailbox.stops};
  mailbox.run = &order;
  tick(10);
  EXPECT_EQ(live.state, LoopState::running);
  EXPECT_EQ(live.stopped_run, 0u);
}

TEST_F(LoopTest, StopEndsAnArming) {
  faulty.card->failure = Failure::stall;
  mailbox.reset();
  tick(2);
  ASSERT_EQ(live.state, LoopState::arming);
  ++mailbox.stops;
  tick();
  EXPECT_EQ(live.state, LoopState::latched);
  EXPECT_EQ(live.fault, Fault::none);
  EXPECT_EQ(live.resets, 1u) << "whoever waits for it is told";
  mailbox.reset();
  tick(2);
  EXPECT_EQ(live.state, LoopState::arming) << "a person may arm again";
}

TEST_F(LoopTest, ALostClientEndsItsRun) {
  run();
  mailbox.lost = 1;
  tick();
  expect_latched_by(Fault::client_lost);
  expect_ended(Outcome::fault, Fault::client_lost);
}

TEST_F(LoopTest, TakesNothingFromTheHeap) {
  run();
  faulty.card->skip = 3;
  HeapGuard guard;
  for (int i = 0; i < 500; ++i) {
    faulty.clock->sleep_until(faulty.clock->now() + period);
    loop.tick(faulty.clock->now(), i % 100 == 0 ? 2 : 0);
  }
  faulty.card->failure = Failure::nan;  // nor when something goes wrong
  for (int i = 0; i < 500; ++i) {
    faulty.clock->sleep_until(faulty.clock->now() + period);
    loop.tick(faulty.clock->now());
  }
  EXPECT_EQ(guard.count(), 0u);
  EXPECT_EQ(live.fault, Fault::non_finite);
}

TEST_F(LoopTest, FeedsTheEstimatorAndNeverWaitsForIt) {
  FaultyBench other;
  EstimatorFeed feed(64);
  Loop fed(other.bench, complete({}), mailbox, live, ring, &feed);
  fed.start();
  ++mailbox.resets;
  Order order{1, Profile("level", {{0, 3}, {1, 3}})};
  const auto tick = [&] {
    other.clock->sleep_until(other.clock->now() + period);
    fed.tick(other.clock->now());
  };
  for (int i = 0; i < 50; ++i) {
    if (i == 20) mailbox.run = &order;
    if (fed.wanted()) fed.prepare();
    tick();
  }
  EstimatorFeed::Sample first;
  ASSERT_TRUE(feed.pop(first));
  EXPECT_GE(first.t, 0);
  EXPECT_LT(first.t, 3 * period);
  HeapGuard guard;
  for (int i = 0; i < 200; ++i) tick();  // nobody empties it
  EXPECT_EQ(guard.count(), 0u);
  EXPECT_GT(feed.lost(), 200u);
  EXPECT_EQ(live.state, LoopState::running) << "a slow estimator is no fault";
}

TEST_F(LoopTest, TheCommandedReferenceIsRecordedAndNotItsReadBack) {
  FaultyBench other;
  other.bench.inputs.push_back(std::make_unique<FaultyInput>(
      other.clock,
      std::vector<Channel>{{.signal = Signal::u_ref, .period = 1e-3, .window = 0, .lsb = 0, .source = "back"}}));
  Loop second(other.bench, complete({}), mailbox, live, ring);
  second.start();
  ++mailbox.resets;
  Order order{1, Profile("level", {{0, 3}, {1, 3}})};
  for (int i = 0; i < 50; ++i) {
    if (i == 5) mailbox.run = &order;
    if (second.wanted()) second.prepare();
    other.clock->sleep_until(other.clock->now() + period);
    second.tick(other.clock->now());
  }
  const auto u = samples(Signal::u_ref);
  ASSERT_GT(u.size(), 30u);
  for (const Record& sample : u) EXPECT_EQ(sample.value, 3) << "the read-back of the fake reads 0";
}

TEST_F(LoopTest, AFieldOrATachoThatNobodyMeasuresIsAMistake) {
  EXPECT_THROW(Loop(faulty.bench, {.field_min = 0.2}, mailbox, live, ring), ConfigError);
  FaultyBench other;
  other.bench.inputs.pop_back();  // the meter
  EXPECT_THROW(Loop(other.bench, {.tacho = BenchConfig::Tacho{.emf = 20, .omega = 5}, .R_a = 32}, mailbox, live, ring),
               ConfigError);
}

TEST_F(LoopTest, TwoChannelsOfOneSignalAreAMistake) {
  FaultyBench other;
  other.bench.inputs.push_back(std::make_unique<FaultyInput>(
      other.clock,
      std::vector<Channel>{{.signal = Signal::omega, .period = 1e-3, .window = 0, .lsb = 0, .source = "2"}}));
  EXPECT_THROW(Loop(other.bench, complete({}), mailbox, live, ring), ConfigError);
}

}  // namespace
}  // namespace emtb
