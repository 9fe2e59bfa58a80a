#include "analysis/check/begins_anew.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

/// An angle of 200 readings, as a function of their number says.
template <class Angle>
Run angle_of(const Angle& angle) {
  Series theta;
  for (int k = 0; k < 200; ++k) theta.t.push_back(0.01 * k), theta.value.push_back(angle(k));
  return {.name = "one", .signals = {{Signal::theta, theta}}};
}

DataFindings look_at_angle(const emtb::Run& run) { return begins_anew(std::span(&run, 1)); }

TEST(BeginsAnew, IsRemarkedOfAnAngleThatWasPutTogether) {
  emtb::Run run = angle_of([](int k) { return 0.3 * k; });
  run.signals.at(Signal::theta).begins_anew_after = 2 * std::numbers::pi;
  const DataFindings found = look_at_angle(run);
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].what, Flaw::angle_speed);
  EXPECT_THAT(found[0].text, HasSubstr("6.28 rad: it was put together"));
  EXPECT_FALSE(found[0].stops);
}

TEST(BeginsAnew, StopsWhereNothingTellsHowFarTheShaftTurned) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> draw(0, 2 * std::numbers::pi);
  const DataFindings found = look_at_angle(angle_of([&](int) { return draw(random); }));
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_THAT(found[0].text, HasSubstr("log it faster"));
  EXPECT_TRUE(found[0].stops);
}

TEST(BeginsAnew, SaysNothingOfAnAngleThatGoesOn) {
  EXPECT_THAT(look_at_angle(angle_of([](int k) { return 0.3 * k; })), IsEmpty());
  EXPECT_THAT(look_at_angle(angle_of([](int k) { return 3 * std::sin(0.1 * k); })), IsEmpty());
}

}  // namespace
}  // namespace emtb
