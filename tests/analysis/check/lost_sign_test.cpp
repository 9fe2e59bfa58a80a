#include "analysis/check/lost_sign.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "analysis/check/check.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// Steps both ways, whose current some logger reads.
template <class Reads>
std::vector<emtb::Run> both_ways(const Reads& reads) {
  emtb::Run run = synthetic::record({}, {{1, 2}, {1, -2}, {1, 1}, {1, -3}, {1, 0}}, 1e-3, {.omega = 0.1, .i_a = 0.02});
  for (double& i : run.signals.at(Signal::i_a).value.edit()) i = reads(i);
  return {run};
}

MATCHER(IsALostSign, "") { return arg.what == Flaw::sign && arg.signal == Signal::i_a && arg.stops; }

TEST(LostSign, IsThatOfACurrentOfWhichOnlyTheSizeWasLogged) {
  const auto findings = check(both_ways([](double i) { return std::abs(i); }), {}, nullptr);
  EXPECT_THAT(findings, testing::Contains(IsALostSign()));
}

TEST(LostSign, IsThatOfAShortRunBackwardsToo) {
  emtb::Run run = synthetic::record({}, {{0.2, 0}, {0.5, -2}, {0.3, -1}}, 5e-3, {.omega = 0.1, .i_a = 0.02});
  const std::vector<emtb::Run> as_it_is{run};
  for (double& i : run.signals.at(Signal::i_a).value.edit()) i = std::abs(i);
  const std::vector<emtb::Run> only_its_size{run};
  EXPECT_THAT(check(only_its_size, {}, nullptr), testing::Contains(IsALostSign()));
  EXPECT_THAT(check(as_it_is, {}, nullptr), testing::Not(testing::Contains(IsALostSign())));
}

TEST(LostSign, IsNotThatOfACurrentThatHasItNorOfOneThatALoadHoldsUp) {
  const auto plain = check(both_ways([](double i) { return i; }), {}, nullptr);
  EXPECT_THAT(plain, testing::Not(testing::Contains(IsALostSign())));
  const auto held_up = check(both_ways([](double i) { return i + 30; }), {}, nullptr);
  EXPECT_THAT(held_up, testing::Not(testing::Contains(IsALostSign())));
}

MATCHER(IsADriveWithoutSign, "") { return arg.what == Flaw::sign && arg.signal == Signal::u_ref && !arg.stops; }

TEST(LostSign, IsRemarkedOfADriveUnderWhichTheShaftTurnsBothWays) {
  std::vector<emtb::Run> runs = both_ways([](double i) { return i; });
  runs[0].signals.erase(Signal::i_a);
  EXPECT_THAT(check(runs, {}, nullptr), testing::Not(testing::Contains(IsADriveWithoutSign())));
  for (double& u : runs[0].signals.at(Signal::u_ref).value.edit()) u = std::abs(u);
  runs[0].signals.erase(Signal::e_a);
  EXPECT_THAT(check(runs, {}, nullptr), testing::Contains(IsADriveWithoutSign()));
}

}  // namespace
}  // namespace emtb
