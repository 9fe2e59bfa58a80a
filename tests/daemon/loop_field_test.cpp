#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "daemon/loop.h"
#include "tests/daemon/loop_bench.h"

namespace emtb {
namespace {

using namespace loop_bench;

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

}  // namespace
}  // namespace emtb
