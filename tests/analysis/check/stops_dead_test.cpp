#include "analysis/check/stops_dead.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <span>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// Two starts, each left to stop for a while.
emtb::Run two_starts() {
  return synthetic::record({}, {{0.1, 0}, {0.4, 3}, {0.4, 0}, {0.4, 3}, {0.4, 0}}, 5e-3, {.omega = 0.1});
}

TEST(StopsDead, IsRemarkedWhereRowsOfAStopAreMissing) {
  emtb::Run run = two_starts();
  EXPECT_THAT(stops_dead(run), testing::IsEmpty()) << "it takes as long to stop as to start";
  const std::span<double> speed = run.signals.at(Signal::omega).value.edit();
  const Series& u = run.at(Signal::u_ref);
  for (std::size_t k = 0; k < speed.size(); ++k) {
    const auto row = static_cast<std::size_t>(std::ranges::upper_bound(u.t, run.at(Signal::omega).t[k]) - u.t.begin());
    if (row > 0 && u.value[row - 1] == 0) speed[k] = 0;
  }
  const DataFindings findings = stops_dead(run);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_THAT(findings[0].text, testing::HasSubstr("2 times"));
  EXPECT_FALSE(findings[0].stops);
}

TEST(StopsDead, IsNotRemarkedOfAMotorThatStartsWithinARow) {
  emtb::Run run = two_starts();
  const std::span<double> speed = run.signals.at(Signal::omega).value.edit();
  for (double& v : speed) v = v > 50 ? 400 : 0;
  EXPECT_THAT(stops_dead(run), testing::IsEmpty());
}

}  // namespace
}  // namespace emtb
