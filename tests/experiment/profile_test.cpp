#include "experiment/profile.h"

#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>

#include "hal/error.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double nan = std::numeric_limits<double>::quiet_NaN();

TEST(Profile, IsLinearBetweenKnots) {
  const Profile profile("p", {{0, 0}, {2, 4}, {4, -4}});
  EXPECT_DOUBLE_EQ(profile.reference(0.5), 1);
  EXPECT_DOUBLE_EQ(profile.reference(2), 4);
  EXPECT_DOUBLE_EQ(profile.reference(3), 0);
}

TEST(Profile, HoldsItsEndsOutside) {
  const Profile profile("p", {{1, 2}, {3, 5}});
  EXPECT_DOUBLE_EQ(profile.reference(-1e9), 2);
  EXPECT_DOUBLE_EQ(profile.reference(1), 2);
  EXPECT_DOUBLE_EQ(profile.reference(3), 5);
  EXPECT_DOUBLE_EQ(profile.reference(1e9), 5);
}

TEST(Profile, OfTwoKnotsAtOneTimeTheLaterHolds) {
  const Profile profile("p", {{0, 0}, {1, 0}, {1, 6}, {2, 6}});
  EXPECT_DOUBLE_EQ(profile.reference(std::nextafter(1.0, 0.0)), 0);
  EXPECT_DOUBLE_EQ(profile.reference(1), 6);
}

TEST(Profile, KnowsItsDurationAndExtremes) {
  const Profile profile("p", {{0, 1}, {1, -3}, {4, 2}});
  EXPECT_DOUBLE_EQ(profile.duration(), 4);
  EXPECT_DOUBLE_EQ(profile.min(), -3);
  EXPECT_DOUBLE_EQ(profile.max(), 2);
}

TEST(Profile, RefusesWhatIsNoProfile) {
  EXPECT_THAT([] { Profile("p", {}); }, ThrowsMessage<ConfigError>(HasSubstr("no knot")));
  EXPECT_THAT([] { Profile("p", {{0, 0}, {2, 1}, {1, 1}}); }, ThrowsMessage<ConfigError>(HasSubstr("backwards")));
  EXPECT_THROW(Profile("p", {{0, nan}}), ConfigError);
  EXPECT_THROW(Profile("p", {{nan, 0}}), ConfigError);
  EXPECT_THROW(Profile("p", {{0, std::numeric_limits<double>::infinity()}}), ConfigError);
}

TEST(Step, RestsHoldsAndRests) {
  const Profile profile = step("s", 6, 1, 2, 3, 0.5);
  EXPECT_DOUBLE_EQ(profile.duration(), 6);
  EXPECT_DOUBLE_EQ(profile.reference(0.999), 0.5);
  EXPECT_DOUBLE_EQ(profile.reference(1), 6);
  EXPECT_DOUBLE_EQ(profile.reference(2.999), 6);
  EXPECT_DOUBLE_EQ(profile.reference(3), 0.5);
  EXPECT_DOUBLE_EQ(profile.reference(6), 0.5);
}

TEST(Step, MayBeginAtOnce) {
  const Profile profile = step("s", 6, 0, 2, 0);
  EXPECT_DOUBLE_EQ(profile.reference(0), 6);
  EXPECT_DOUBLE_EQ(profile.reference(1.999), 6);
  EXPECT_DOUBLE_EQ(profile.reference(2), 0);
}

TEST(Step, RefusesNegativeDurations) {
  EXPECT_THROW(step("s", 6, -1, 2, 3), ConfigError);
  EXPECT_THROW(step("s", 6, 1, -2, 3), ConfigError);
  EXPECT_THROW(step("s", 6, 1, 2, -3), ConfigError);
}

TEST(Ramp, ClimbsAndFallsAtItsRate) {
  const Profile profile = ramp("r", -6, 2, 1, 4, 1);
  EXPECT_DOUBLE_EQ(profile.duration(), 1 + 3 + 4 + 3 + 1);
  EXPECT_DOUBLE_EQ(profile.reference(2), -2);
  EXPECT_DOUBLE_EQ(profile.reference(4), -6);
  EXPECT_DOUBLE_EQ(profile.reference(8), -6);
  EXPECT_DOUBLE_EQ(profile.reference(9), -4);
  EXPECT_DOUBLE_EQ(profile.reference(11.5), 0);
}

TEST(Ramp, RefusesARateThatLeadsNowhere) {
  EXPECT_THROW(ramp("r", 6, 0, 1, 1, 1), ConfigError);
  EXPECT_THROW(ramp("r", 6, -1, 1, 1, 1), ConfigError);
  EXPECT_THROW(ramp("r", 6, nan, 1, 1, 1), ConfigError);
}

TEST(Staircase, HoldsEachLevelInTurn) {
  const std::array levels{1.0, -2.0, 3.0};
  const Profile profile = staircase("s", levels, 1, 2, 1);
  EXPECT_DOUBLE_EQ(profile.duration(), 8);
  EXPECT_DOUBLE_EQ(profile.reference(0.5), 0);
  EXPECT_DOUBLE_EQ(profile.reference(1.5), 1);
  EXPECT_DOUBLE_EQ(profile.reference(3.5), -2);
  EXPECT_DOUBLE_EQ(profile.reference(5.5), 3);
  EXPECT_DOUBLE_EQ(profile.reference(7.5), 0);
}

TEST(RandomSteps, StaysInItsRangesAndLastsAsLongAsAsked) {
  const Profile profile = random_steps("r", -3, 5, 0.2, 0.7, 1, 30, 2, 7);
  EXPECT_NEAR(profile.duration(), 33, 1e-9);
  EXPECT_GE(profile.min(), -3);
  EXPECT_LE(profile.max(), 5);
  EXPECT_LT(profile.min(), -1);
  EXPECT_GT(profile.max(), 3);
  const auto knots = profile.knots();
  for (std::size_t i = 2; i + 4 < knots.size(); i += 2) {  // pairs: begin and end of a level; the last is cut
    const double held = knots[i + 1].t - knots[i].t;
    EXPECT_GE(held, 0.2 - 1e-9);
    EXPECT_LE(held, 0.7 + 1e-9);
  }
}

TEST(RandomSteps, TheSeedDecides) {
  const auto values = [](std::uint64_t seed) {
    std::vector<double> list;
    const Profile profile = random_steps("r", 0, 6, 1, 2, 1, 20, 1, seed);
    for (const Knot& knot : profile.knots()) list.push_back(knot.value);
    return list;
  };
  EXPECT_EQ(values(1), values(1));
  EXPECT_NE(values(1), values(2));
}

TEST(RandomSteps, IsTheSameOnEveryMachine) {  // if this fails, sessions recorded elsewhere had another profile
  const Profile profile = random_steps("r", 0, 6, 1, 2, 1, 20, 1, 2011);
  EXPECT_NEAR(profile.reference(1.5), 0.129, 1e-9);
  EXPECT_NEAR(profile.knots()[3].t, 2.742, 1e-9);
}

TEST(RandomSteps, RefusesRangesUpsideDown) {
  EXPECT_THROW(random_steps("r", 6, 0, 1, 2, 1, 20, 1, 1), ConfigError);
  EXPECT_THROW(random_steps("r", 0, 6, 2, 1, 1, 20, 1, 1), ConfigError);
  EXPECT_THROW(random_steps("r", 0, 6, 0, 1, 1, 20, 1, 1), ConfigError);
  EXPECT_THROW(random_steps("r", 0, 6, 0.001, 1, 1, 1e6, 1, 1), ConfigError);
  EXPECT_THROW(random_steps("r", nan, 6, 1, 1, 1, 2, 1, 1), ConfigError);
}

}  // namespace
}  // namespace emtb
