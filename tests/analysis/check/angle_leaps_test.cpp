#include "analysis/check/angle_leaps.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <span>

#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// A servo's angle, read in steps of 0.06 rad each 2 ms.
emtb::Run potentiometer() {
  emtb::Run run = synthetic::record({}, {{0.02, 0}, {0.5, 3}, {0.5, -2}, {0.3, 0}}, 2e-3, {.omega = 0.1});
  Series theta;
  theta.t = run.at(Signal::omega).t;
  double angle = 0;
  for (const double omega : run.at(Signal::omega).value) {
    angle += 2e-3 * omega;
    theta.value.push_back(0.06 * std::round(angle / 0.06));
  }
  run.signals.erase(Signal::omega);
  run.signals[Signal::theta] = theta;
  return run;
}

TEST(AngleLeaps, WhereItsCounterIsSet) {
  emtb::Run run = potentiometer();
  EXPECT_THAT(angle_leaps(run), testing::IsEmpty());
  const std::span<double> theta = run.signals.at(Signal::theta).value.edit();
  for (double& angle : theta.subspan(4)) angle += 20;
  DataFindings findings = angle_leaps(run);
  ASSERT_EQ(findings.size(), 1U);
  EXPECT_TRUE(findings[0].stops);
  EXPECT_THAT(findings[0].text, testing::HasSubstr("leave out the rows before it"));
  for (double& angle : theta.subspan(300)) angle -= 40;
  findings = angle_leaps(run);
  EXPECT_THAT(findings, testing::IsEmpty()) << "twice: nothing says which is none of the shaft's";
}

}  // namespace
}  // namespace emtb
