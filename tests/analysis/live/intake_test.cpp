#include "analysis/live/intake.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis/live/plan.h"
#include "model/model.h"

namespace emtb {
namespace {

using testing::IsEmpty;
using testing::SizeIs;
using Kind = LiveTick::Kind;

constexpr double rate = 1000, period = 1 / rate;  // [Hz], [s]

/// Readings of a tacho on a card and of a slow meter of the current.
class LiveIntakeTest : public testing::Test {
 protected:
  LiveIntakeTest() {
    plan.period = period;
    plan.longest_gap = 6 * period;
    plan.longest_window = 2;
    plan.outputs = {{.signal = Signal::omega}, {.signal = Signal::i_a, .slow = true}};
  }
  bool tick(int k) { return intake.take(Signal::u_ref, k * period, 1); }
  const std::vector<LiveTick>& ticks() { return history.current().ticks; }

  LivePlan plan;
  const std::vector<Channel> channels{
      {.signal = Signal::omega, .period = period, .window = 0, .lsb = 0.1, .source = "card"},
      {.signal = Signal::i_a, .period = 0.4, .window = 0, .lsb = 0.01, .source = "meter"}};
  LiveHistory history{1000, rate};
  LiveIntake intake{plan, channels, false, history};
};

TEST_F(LiveIntakeTest, AReadingGoesToTheTickOfItsTimeHoweverItArrives) {
  intake.take(Signal::omega, 2 * period, 12);  // ahead of the reference: waits
  for (int k = 0; k <= 10; ++k) EXPECT_TRUE(tick(k));
  intake.take(Signal::omega, 4.2 * period, 14);  // of a card that sends blocks
  EXPECT_TRUE(tick(11));
  EXPECT_EQ(ticks()[2].omega, 12);
  EXPECT_EQ(ticks()[4].omega, 14);
  EXPECT_TRUE(std::isnan(ticks()[3].omega));
  EXPECT_EQ(intake.counts().skipped, 0U);
}

TEST_F(LiveIntakeTest, AHoleInTheTicksIsAGapAndTimeNeverGoesBack) {
  for (const int k : {0, 1, 2, 20, 21}) EXPECT_TRUE(tick(k));
  EXPECT_FALSE(tick(21));
  EXPECT_FALSE(tick(5));
  EXPECT_EQ(ticks()[0].kind, Kind::run_start);
  EXPECT_EQ(ticks()[2].kind, Kind::next);
  EXPECT_EQ(ticks()[3].kind, Kind::gap);
  EXPECT_EQ(intake.counts().gaps, 1U);
  EXPECT_EQ(intake.counts().skipped, 2U);
  intake.start_run(30);
  EXPECT_TRUE(tick(0)) << "of the next run";
  EXPECT_EQ(ticks().back().kind, Kind::run_start);
  EXPECT_EQ(ticks().back().field_on, 30);
}

TEST_F(LiveIntakeTest, ASlowMeterReadsTheMeanSinceTheReadingBefore) {
  tick(0);
  intake.take(Signal::i_a, 0.4, 1);
  EXPECT_THAT(history.current().readings, IsEmpty()) << "since when is not known";
  intake.take(Signal::i_a, 0.8, 2);
  intake.take(Signal::i_a, 5, 3);
  ASSERT_THAT(history.current().readings, SizeIs(1)) << "a window as long as that tells nothing";
  EXPECT_EQ(history.current().readings[0].begin, 0.4);
  EXPECT_EQ(history.current().readings[0].end, 0.8);
  EXPECT_EQ(history.current().readings[0].value, 2);
}

TEST_F(LiveIntakeTest, ATickIsCompleteWhenItsReadingsCannotComeAnyMore) {
  tick(0);
  EXPECT_EQ(history.complete(), 0U) << "a run begins with the speed of its first readings";
  int k = 1;
  while (history.complete() == 0 && k < 200) tick(k++);
  EXPECT_GT(k, 50);
  EXPECT_LT(k, 80);
  const std::size_t complete = history.complete();
  tick(k);
  EXPECT_EQ(history.complete(), complete + 1);
}

}  // namespace
}  // namespace emtb
