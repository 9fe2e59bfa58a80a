#include "experiment/first_experiments.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "hal/error.h"

namespace emtb {
namespace {

std::vector<Profile> all_of(const Experiments& e) {
  std::vector<Profile> all = e.train;
  all.insert(all.end(), e.held_out.begin(), e.held_out.end());
  return all;
}

double largest_jump(const Profile& profile) {
  double largest = 0;
  for (std::size_t i = 1; i < profile.knots().size(); ++i) {
    const Knot &a = profile.knots()[i - 1], &b = profile.knots()[i];
    if (b.t - a.t < 1e-9) largest = std::max(largest, std::abs(b.value - a.value));
  }
  return largest;
}

TEST(FirstExperiments, StayWithinTheReferenceAndUseAllOfIt) {
  for (const double low : {0.0, -4.0}) {
    double lowest = 0, highest = 0;
    for (const Profile& p : all_of(first_experiments(low, 5, 10))) {
      lowest = std::min(lowest, p.min());
      highest = std::max(highest, p.max());
    }
    EXPECT_DOUBLE_EQ(lowest, low);
    EXPECT_DOUBLE_EQ(highest, 5);
  }
}

TEST(FirstExperiments, JumpNoFurtherThanAStartToTheTop) {
  std::vector<Profile> all = all_of(first_experiments(-5, 5, 10));
  all.push_back(confirming_experiment(-5, 5, 10, 7));
  for (const Profile& p : all) EXPECT_LE(largest_jump(p), 5 + 1e-9) << p.name();
}

TEST(FirstExperiments, AreSixUnderNamesOfTheirOwnThatBeginAndEndAtRest) {
  const std::vector<Profile> all = all_of(first_experiments(0, 6, 10));
  EXPECT_EQ(all.size(), 6U);
  std::set<std::string> names;
  for (const Profile& p : all) {
    names.insert(p.name());
    EXPECT_EQ(p.reference(0), 0) << p.name();
    EXPECT_EQ(p.reference(p.duration()), 0) << p.name();
  }
  EXPECT_EQ(names.size(), 6U);
}

TEST(FirstExperiments, LastInProportionToTheTimeThatTheMotorTakes) {
  const Experiments slow = first_experiments(0, 6, 10), fast = first_experiments(0, 6, 1);
  for (std::size_t i = 0; i < slow.train.size(); ++i) {
    EXPECT_NEAR(slow.train[i].duration(), 10 * fast.train[i].duration(), 0.02 * slow.train[i].duration());
  }
}

TEST(FirstExperiments, TheConfirmingRunIsAnother) {
  const Profile random = first_experiments(0, 6, 10).train.back(), confirm = confirming_experiment(0, 6, 10, 2);
  double difference = 0;
  for (double t = 0; t < confirm.duration(); t += 0.1) {
    difference = std::max(difference, std::abs(confirm.reference(t) - random.reference(t)));
  }
  EXPECT_GT(difference, 1);
}

TEST(FirstExperiments, RefuseAReferenceOrATimeThatMakesNoSense) {
  EXPECT_THROW(first_experiments(1, 6, 10), ConfigError);
  EXPECT_THROW(first_experiments(0, 0, 10), ConfigError);
  EXPECT_THROW(first_experiments(0, 6, 0), ConfigError);
  EXPECT_THROW(confirming_experiment(0, 6, std::nan(""), 1), ConfigError);
}

}  // namespace
}  // namespace emtb
