#include "model/machine/memory.h"

#include <gtest/gtest.h>

#include <cmath>

namespace emtb {
namespace {

/// dz/dt = (goal - z)/tau
auto lag(double goal, double tau) {
  return [goal, tau](double z, double& slope) {
    slope = -1 / tau;
    return (goal - z) / tau;
  };
}

double lagging_after(double time, int steps) {
  double z = 0;
  for (int n = 0; n < steps; ++n) z = remembered_after(z, time / steps, lag(1, 0.5)).end;
  return z;
}

TEST(Memory, IsOfSecondOrderInTheStep) {
  const double exact = 1 - std::exp(-2.0);
  const double off = std::abs(lagging_after(1, 20) - exact), half = std::abs(lagging_after(1, 40) - exact);
  EXPECT_LT(off, 1e-3);
  EXPECT_NEAR(off / half, 4, 0.05);
}

TEST(Memory, ShorterThanAStepHasFollowedAtItsEndAndDoesNotSwing) {
  for (const double tau : {0.4, 0.1, 1e-3, 1e-9}) {
    const Remembered<double> after = remembered_after(-1.0, 1.0, lag(1, tau));
    EXPECT_NEAR(after.end, 1, 1e-9) << tau;
    EXPECT_LE(after.in_middle, 1) << tau;
    EXPECT_GE(after.in_middle, -1) << tau;
  }
  EXPECT_LT(remembered_after(-1.0, 1.0, lag(1, 0.6)).end, 1) << "one that is longer has not";
}

TEST(Memory, FollowsARateThatBends) {
  const auto friction = [](double z, double& slope) {  // gives before it slips
    slope = -3 * (1 - z) * (1 - z);
    return (1 - z) * (1 - z) * (1 - z);
  };
  const double h = 0.3, z = 0.2, end = remembered_after(z, h, friction).end, at = 0.5 * (z + end);
  EXPECT_NEAR(end, z + h * std::pow(1 - at, 3), 1e-12);
}

TEST(Memory, ThatOutgrowsItselfIsExplicit) {
  const auto grows = [](double z, double& slope) {
    slope = 10;
    return 10 * z;
  };
  EXPECT_DOUBLE_EQ(remembered_after(1.0, 1.0, grows).end, 11);
}

TEST(Memory, LastsWhereItsRateIsNothing) {
  EXPECT_NEAR(lasting_memory<double>(lag(0.7, 3)), 0.7, 1e-12);
  const auto bent = [](double z, double& slope) {
    slope = -1 - 3 * z * z;
    return 2 - z - z * z * z;
  };
  EXPECT_NEAR(lasting_memory<double>(bent), 1, 1e-12);
}

TEST(Memory, OfNothingIsLeftWhereARateDoesNotEndIt) {
  const auto stays = [](double, double& slope) { return slope = 0; };
  const auto grows = [](double z, double& slope) {
    slope = 1;
    return 1 + z;
  };
  EXPECT_EQ(lasting_memory<double>(stays), 0) << "dry friction at rest";
  EXPECT_EQ(lasting_memory<double>(grows), 0);
}

}  // namespace
}  // namespace emtb
