#include "analysis/live/change_watch.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "analysis/live/change_test.h"

namespace emtb {
namespace {

using testing::IsEmpty;
using testing::SizeIs;
using Then = ChangeWatch::Then;

constexpr double quiet = 1, doubtful = change_at::doubtful + 0.5, alarm = change_at::alarm + 1;  // standard errors

class ChangeWatchTest : public testing::Test {
 protected:
  /// Half-seconds in which the motor turns and looks like this.
  Then see(double score, int half_seconds = 1) {
    Then then = Then::wait;
    for (int k = 0; k < half_seconds; ++k) {
      watch.see();
      then = watch.look(score, score);
      if (then == Then::begin_again) watch.forget();
      watch.becomes_known();
    }
    return then;
  }

  ChangeWatch watch;
};

TEST_F(ChangeWatchTest, TakesTheEstimatorsValuesUntilTheMotorIsKnown) {
  see(quiet, 59);
  EXPECT_TRUE(watch.takes_values());
  EXPECT_EQ(see(quiet), Then::wait);
  EXPECT_FALSE(watch.takes_values());
  EXPECT_EQ(see(quiet), Then::learn);
  EXPECT_EQ(see(doubtful), Then::wait) << "nothing is learnt of what is doubtful";
}

TEST_F(ChangeWatchTest, ASuspicionOfAMotorThatIsNotKnownBeginsTheLearningAgain) {
  see(quiet, 30);
  EXPECT_EQ(see(alarm), Then::begin_again);
  EXPECT_EQ(watch.seen(), 0U);
}

TEST_F(ChangeWatchTest, TellsWhatStandsForFiveLooksAndThenFollowsIt) {
  see(quiet, 70);
  EXPECT_EQ(see(alarm, 4), Then::wait);
  see(quiet);
  EXPECT_EQ(see(alarm, 4), Then::wait) << "it has to stand";
  EXPECT_EQ(see(alarm), Then::tell);
  watch.tell({.since = 10, .noticed = 12, .suspects = {}}, 3);
  EXPECT_TRUE(watch.following());
  EXPECT_FALSE(watch.watching());
  EXPECT_THAT(watch.news(), SizeIs(1));
  EXPECT_THAT(watch.news(), IsEmpty()) << "once";
  EXPECT_EQ(watch.follow_on(), 4U);
  watch.correct(alarm, {.since = 11, .noticed = 20, .suspects = {}});
  EXPECT_EQ(watch.changes().back().since, 11);
  EXPECT_EQ(watch.changes().back().noticed, 12) << "it was noticed when it was told";
  watch.correct(quiet, {.since = 15, .noticed = 21, .suspects = {}});
  EXPECT_EQ(watch.changes().back().since, 11) << "what is not seen any more corrects nothing";
  while (!watch.followed()) watch.follow_on();
  EXPECT_EQ(watch.since_change(), ChangeWatch::follow);
}

}  // namespace
}  // namespace emtb
