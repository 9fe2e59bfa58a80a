#include "daemon/loop.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "daemon/recorder.h"
#include "session/session.h"
#include "tests/daemon/heap_guard.h"
#include "tests/faulty_device.h"

namespace emtb {
namespace {

constexpr double period = 1e-3;  // [s]
const BenchConfig::SafetyLimits limits{.omega = 190, .i_a = 2, .torque = 0.8, .time = 5};

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

TEST_F(LoopTest, StopEndsOnlyTheRunThatWasMeant) {
  run();
  mailbox.stop = 99;
  tick();
  EXPECT_EQ(live.state, LoopState::running);
  mailbox.stop = 1;
  tick();
  EXPECT_EQ(faulty.output->volts, 0);
  EXPECT_EQ(live.state, LoopState::armed);
  expect_ended(Outcome::stopped, Fault::none);
}

TEST_F(LoopTest, ALostClientEndsItsRun) {
  run();
  mailbox.lost = 1;
  tick();
  expect_latched_by(Fault::client_lost);
  expect_ended(Outcome::fault, Fault::client_lost);
}

TEST_F(LoopTest, TerminationEndsTheRunAndCannotBeReset) {
  run();
  mailbox.terminate = true;
  tick();
  expect_latched_by(Fault::terminated);
  expect_ended(Outcome::fault, Fault::terminated);
  reset();
  expect_latched_by(Fault::terminated);
}

TEST_F(LoopTest, AFailedRecorderEndsTheRun) {
  run();
  mailbox.recorder_failed = true;
  tick();
  expect_latched_by(Fault::recorder_failed);
}

TEST_F(LoopTest, TooLongARunEnds) {
  run(Profile("long", {{0, 3}, {60, 3}}));
  tick(5000);
  expect_latched_by(Fault::run_too_long);
}

TEST_F(LoopTest, ABriefStallOfTheMachineIsNoOverrunButALongOneIs) {
  run();
  faulty.clock->sleep_until(faulty.clock->now() + 0.05);
  loop.tick(faulty.clock->now(), 49);
  EXPECT_EQ(live.state, LoopState::running);
  EXPECT_EQ(live.missed, 49u);
  const auto gaps = of(Record::Kind::event);
  ASSERT_EQ(gaps.size(), 1u) << "recorded in its place";
  EXPECT_EQ(gaps[0].code, event_code::gap);
  EXPECT_EQ(gaps[0].value, 49);
  EXPECT_NEAR(gaps[0].t, 0.149, 2e-3);
  loop.tick(faulty.clock->now() + 1e-3, 600);
  expect_latched_by(Fault::overrun);
}

TEST_F(LoopTest, AFaultIsRecordedOnceWithSignalAndValue) {
  run();
  faulty.card->set(Signal::omega, -200);
  tick(50);
  expect_latched_by(Fault::over_speed);
  EXPECT_EQ(live.fault_signal, static_cast<int>(index(Signal::omega)));
  const auto events = of(Record::Kind::event);
  ASSERT_EQ(events.size(), 1u);
  EXPECT_EQ(events[0].code, 101);
  EXPECT_EQ(events[0].value, -200);
  EXPECT_NEAR(events[0].t, 0.1, 2e-3);
  EXPECT_THAT(describe(Fault::over_speed, events[0].signal, events[0].value), testing::HasSubstr("omega = -200 rad/s"));
}

TEST_F(LoopTest, AFieldOfFaultsCannotBeOutrunByAnotherRun) {
  run();
  faulty.card->set(Signal::omega, 200);
  tick();
  Order second{8, Profile("level", {{0, 3}, {1, 3}})};
  mailbox.run = &second;
  tick(400);
  EXPECT_EQ(faulty.output->volts, 0);
  EXPECT_EQ(of(Record::Kind::end).size(), 2u);
  EXPECT_EQ(live.state, LoopState::latched);
}

TEST_F(LoopTest, SaysSoWhereTheOutputDoesNotEvenGoSafe) {
  run();
  faulty.output->fail_safe = Fault::output_failed;
  faulty.card->set(Signal::omega, 200);
  tick(500);
  EXPECT_EQ(live.fault, Fault::over_speed) << "the first cause stays";
  EXPECT_TRUE(live.output_broken);
  EXPECT_GE(faulty.output->safes, 4) << "it is tried again and again";
  const auto events = of(Record::Kind::event);
  EXPECT_TRUE(std::ranges::any_of(events, [](const Record& e) { return e.code == 302; }));
  reset();
  expect_ended(Outcome::fault, Fault::over_speed);
  EXPECT_EQ(live.fault, Fault::output_failed) << "a reset finds what stands";
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

/// A bench with a field current, which somebody has to prove.
class FieldTest : public testing::Test {
 protected:
  FieldTest() {
    auto input = std::make_unique<FaultyInput>(
        faulty.clock,
        std::vector<Channel>{{.signal = Signal::i_f, .period = 1e-3, .window = 0, .lsb = 0, .source = "field"}});
    field = input.get();
    field->set(Signal::i_f, 0.3);
    faulty.bench.inputs.push_back(std::move(input));
    loop = std::make_unique<Loop>(faulty.bench,
                                  Loop::Settings{.reference = {.min = 0, .max = 6, .safe = 0}, .field_min = 0.2},
                                  mailbox, live, ring);
    loop->start();
  }
  void tick(int times = 1) {
    for (; times > 0; --times) {
      if (loop->wanted()) loop->prepare();
      faulty.clock->sleep_until(faulty.clock->now() + 1e-3);
      loop->tick(faulty.clock->now());
    }
  }
  FaultyBench faulty;
  FaultyInput* field = nullptr;
  Mailbox mailbox;
  Live live;
  Ring ring{1 << 14};
  std::unique_ptr<Loop> loop;
  const Order order{1, Profile("level", {{0, 3}, {1, 3}})};
};

TEST_F(FieldTest, AHealthyFieldOfEitherSignNeverTrips) {
  for (const double i_f : {0.3, -0.3}) {
    field->set(Signal::i_f, i_f);
    ++mailbox.resets;
    tick(3);
    mailbox.run = &order;
    tick(1200);
    EXPECT_EQ(live.state, LoopState::armed);
    EXPECT_EQ(faulty.output->highest, 3) << "it ran";
  }
}

TEST_F(FieldTest, WithoutAFieldNothingIsArmed) {
  field->set(Signal::i_f, 0.05);
  ++mailbox.resets;
  tick(3);
  EXPECT_EQ(live.state, LoopState::latched);
  EXPECT_EQ(live.fault, Fault::field_lost);
  EXPECT_EQ(faulty.output->sets, 0);
}

TEST_F(FieldTest, AFieldThatIsLostInARunEndsItInTheSamePeriod) {
  ++mailbox.resets;
  tick(3);
  mailbox.run = &order;
  tick(100);
  ASSERT_EQ(faulty.output->volts, 3);
  field->set(Signal::i_f, 0);
  tick();
  EXPECT_EQ(live.fault, Fault::field_lost);
  EXPECT_EQ(faulty.output->volts, 0);
}

TEST_F(FieldTest, ARunSaysForHowLongItHasBeenOn) {
  const auto told = [&](const Order& run) {
    mailbox.run = &run;
    tick(1200);
    std::optional<double> seconds;
    ring.consume_all([&](const Record& r) {
      if (r.kind == Record::Kind::field) seconds = r.value;
    });
    return seconds;
  };
  tick(500);  // latched, and warming up
  ++mailbox.resets;
  tick(3);
  EXPECT_NEAR(told(order).value(), 0.503, 0.003);
  const Order next{2, order.profile};
  EXPECT_NEAR(told(next).value(), 1.703, 0.003);
  field->set(Signal::i_f, 0);
  tick(100);
  field->set(Signal::i_f, 0.3);
  tick(10);
  ++mailbox.resets;
  tick(3);
  const Order after{3, order.profile};
  EXPECT_NEAR(told(after).value(), 0.013, 0.003) << "it cooled down meanwhile, as far as anybody knows";
}

TEST_F(LoopTest, WhereNobodyWatchesTheFieldItIsTakenToBeOnSinceTheBenchWasArmed) {
  tick(300);
  reset();
  tick(40);
  run(Profile("short", {{0, 1}, {0.1, 1}}));
  tick(300);
  const auto told = of(Record::Kind::field);
  ASSERT_EQ(told.size(), 1u);
  EXPECT_NEAR(told[0].value, 0.042, 0.003);
  EXPECT_EQ(told[0].t, 0);
}

TEST_F(LoopTest, AFieldOrATachoThatNobodyMeasuresIsAMistake) {
  EXPECT_THROW(Loop(faulty.bench, {.field_min = 0.2}, mailbox, live, ring), ConfigError);
  FaultyBench other;
  other.bench.inputs.pop_back();  // the meter
  EXPECT_THROW(Loop(other.bench, {.tacho = BenchConfig::Tacho{.emf = 20, .omega = 5}, .R_a = 32}, mailbox, live, ring),
               ConfigError);
}

/// With a tacho that is watched.
class TachoLoopTest : public LoopTest {
 protected:
  TachoLoopTest() : LoopTest(1 << 16, {.tacho = BenchConfig::Tacho{.emf = 20, .omega = 5}, .R_a = 32}) {}
};

TEST_F(TachoLoopTest, ADeadTachoEndsTheRun) {
  run();
  faulty.card->set(Signal::e_a, 55);
  faulty.meter->set(Signal::i_a, 0.1);
  tick(900);
  EXPECT_EQ(live.state, LoopState::running) << "not long enough yet to be sure";
  tick(200);
  EXPECT_EQ(live.fault, Fault::dead_tacho) << text(live.fault);
  EXPECT_EQ(faulty.output->volts, 0);
}

TEST_F(LoopTest, ADiskThatFillsEndsTheRunWhileTheSessionCanStillEndWell) {
  run();
  mailbox.disk_low = true;
  tick();
  expect_latched_by(Fault::disk_nearly_full);
  reset();
  EXPECT_EQ(live.state, LoopState::armed) << "without a run there is nothing to record";
}

TEST_F(LoopTest, AClockThatRunsBackwardsIsAFault) {
  run();
  faulty.card->failure = Failure::behind;
  tick();
  expect_latched_by(Fault::device_clock);
}

TEST_F(LoopTest, TwoChannelsOfOneSignalAreAMistake) {
  FaultyBench other;
  other.bench.inputs.push_back(std::make_unique<FaultyInput>(
      other.clock,
      std::vector<Channel>{{.signal = Signal::omega, .period = 1e-3, .window = 0, .lsb = 0, .source = "2"}}));
  EXPECT_THROW(Loop(other.bench, complete({}), mailbox, live, ring), ConfigError);
}

/// With a ring that nobody empties.
class CrowdedLoopTest : public LoopTest {
 protected:
  CrowdedLoopTest() : LoopTest(256) {}
};

TEST_F(CrowdedLoopTest, ARecorderThatDoesNotKeepUpEndsTheRunAndTheEndIsNotLost) {
  run();
  expect_latched_by(Fault::recorder_behind);
  tick(300);
  records();  // now the recorder is back
  tick(2);
  const auto ends = of(Record::Kind::end);
  ASSERT_EQ(ends.size(), 1u);
  EXPECT_EQ(ends[0].code, static_cast<int>(Fault::recorder_behind));
  EXPECT_EQ(of(Record::Kind::event).size(), 1u);
}

/// Every call of the hal made to fail in turn, in idle and in a run: latched, safe, and named, by the next ticks.
struct Sweep {
  const char* name;
  void (*fail)(FaultyBench&);
  Fault fault;
};

void PrintTo(const Sweep& sweep, std::ostream* out) { *out << sweep.name; }

class FaultSweep : public LoopTest, public testing::WithParamInterface<Sweep> {};

TEST_P(FaultSweep, LatchesAndGoesSafeInIdle) {
  reset();
  ASSERT_EQ(live.state, LoopState::armed);
  GetParam().fail(faulty);
  tick(300);  // a stall shows after 0.25 s
  EXPECT_EQ(live.state, LoopState::latched);
  EXPECT_EQ(live.fault, GetParam().fault) << text(live.fault);
  reset();
  tick(300);
  EXPECT_EQ(live.state, LoopState::latched) << "the cause still stands";
}

TEST_P(FaultSweep, LatchesAndGoesSafeInARun) {
  run();
  ASSERT_EQ(live.state, LoopState::running);
  ASSERT_EQ(faulty.output->volts, 3);
  GetParam().fail(faulty);
  tick(300);
  expect_latched_by(GetParam().fault);
  EXPECT_THAT(of(Record::Kind::event), testing::SizeIs(testing::Ge(1u)));
  EXPECT_EQ(of(Record::Kind::event)[0].code, static_cast<int>(GetParam().fault));
  expect_ended(Outcome::fault, GetParam().fault);
}

TEST_P(FaultSweep, LatchesAndGoesSafeAtTheStartOfARun) {
  reset();
  GetParam().fail(faulty);
  Order order{1, Profile("level", {{0, 3}, {1, 3}})};
  mailbox.run = &order;
  tick(300);
  expect_latched_by(GetParam().fault);
  expect_ended(Outcome::fault, GetParam().fault);
}

INSTANTIATE_TEST_SUITE_P(
    EveryCall, FaultSweep,
    testing::Values(
        Sweep{"ReadReturnsAFault", [](FaultyBench& b) { b.card->failure = Failure::error; }, Fault::device_lost},
        Sweep{"ReadGivesNaN", [](FaultyBench& b) { b.card->failure = Failure::nan; }, Fault::non_finite},
        Sweep{"ReadGivesInfinity", [](FaultyBench& b) { b.meter->failure = Failure::infinity; }, Fault::non_finite},
        Sweep{"ReadStalls", [](FaultyBench& b) { b.meter->failure = Failure::stall; }, Fault::stale_signal},
        Sweep{"DeviceDisappears", [](FaultyBench& b) { b.card->failure = Failure::gone; }, Fault::device_lost},
        Sweep{"SecondDeviceDisappears", [](FaultyBench& b) { b.meter->failure = Failure::gone; }, Fault::device_lost},
        Sweep{"OverSpeed", [](FaultyBench& b) { b.card->set(Signal::omega, 200); }, Fault::over_speed},
        Sweep{"OverCurrent", [](FaultyBench& b) { b.meter->set(Signal::i_a, -3); }, Fault::over_current}),
    [](const auto& sweep) { return sweep.param.name; });

TEST_F(LoopTest, AnOutputThatRefusesAValueLatches) {
  run();
  faulty.output->fail_set = Fault::output_failed;
  tick();
  expect_latched_by(Fault::output_failed);
  expect_ended(Outcome::fault, Fault::output_failed);
  reset();
  tick(2);
  EXPECT_EQ(live.fault, Fault::output_failed) << "it goes safe, but still refuses values";
}

TEST_F(LoopTest, AnOutputThatRefusesInIdleLatches) {
  reset();
  faulty.output->fail_set = Fault::device_lost;
  tick();
  expect_latched_by(Fault::device_lost);
}

}  // namespace
}  // namespace emtb
