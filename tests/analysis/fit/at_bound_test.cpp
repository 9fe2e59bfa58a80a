#include "analysis/fit/at_bound.h"

#include <gtest/gtest.h>

#include <limits>

namespace emtb {
namespace {

/// Windage as the library bounds it: five orders above a small motor's.
Parameter windage(double value) {
  Parameter p;
  p.value = value;
  p.min = 0;
  p.max = 1e-2;
  return p;
}

constexpr double scale = 1e-9;  // [N m s2/rad2] a standard error of it

TEST(AtBound, AValueFarBelowTheWidthOfItsBoundsDoesNotRestOnThem) {
  EXPECT_FALSE(rests_on_bound(windage(5e-10), -1 / scale, scale));  // half a standard error, 5e-8 of the width
  EXPECT_FALSE(rests_on_bound(windage(1e-8), 1 / scale, scale));
}

TEST(AtBound, AValueOnItsBoundThatTheDataPullOutwardsRestsThere) {
  EXPECT_TRUE(rests_on_bound(windage(0), -1 / scale, scale));
  EXPECT_TRUE(rests_on_bound(windage(1e-16), -1 / scale, scale)) << "a millionth of a standard error is no distance";
  EXPECT_TRUE(rests_on_bound(windage(1e-2), 1 / scale, scale));
}

TEST(AtBound, AValueOnItsBoundThatTheDataPullInwardsDoesNotRest) {
  EXPECT_FALSE(rests_on_bound(windage(0), 3 / scale, scale));  // three standard errors
  EXPECT_FALSE(rests_on_bound(windage(1e-2), -3 / scale, scale));
}

TEST(AtBound, AFlatDirectionThatEndsOnABoundRestsThereWhicheverWayTheRestOfItsGradientPoints) {
  for (const double pull : {-0.1 / scale, 0.1 / scale}) {
    EXPECT_TRUE(rests_on_bound(windage(0), pull, scale));
    EXPECT_TRUE(rests_on_bound(windage(1e-2), pull, scale));
  }
}

TEST(AtBound, WhereTheDataSayNothingTheValueItselfIsTheScale) {
  EXPECT_TRUE(rests_on_bound(windage(0), 0, std::numeric_limits<double>::infinity()));
  EXPECT_FALSE(rests_on_bound(windage(1e-6), 0, std::numeric_limits<double>::infinity()));
}

}  // namespace
}  // namespace emtb
