#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/loop.h"
#include "tests/daemon/loop_bench.h"

namespace emtb {
namespace {

using namespace loop_bench;

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

TEST_F(LoopTest, TerminationEndsTheRunAndCannotBeReset) {
  run();
  mailbox.terminate = true;
  tick();
  expect_latched_by(Fault::terminated);
  expect_ended(Outcome::fault, Fault::terminated);
  reset();
  expect_latched_by(Fault::terminated);
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
        Sweep{"ReadGivesInfinity", [](FaultyBench& b) { b.meter->failure = Failure::infinite; }, Fault::non_finite},
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
