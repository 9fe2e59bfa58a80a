#include "analysis/record/error_column.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(ErrorColumn, HoldsSevenDigitsOfEach) {
  const ErrorColumn errors(std::vector{0.1, 2.5, 1e-9});
  ASSERT_EQ(errors.size(), 3U);
  EXPECT_NEAR(errors[0], 0.1, 1e-8);
  EXPECT_EQ(errors[1], 2.5);
  EXPECT_NEAR(errors[2], 1e-9, 1e-16);
  EXPECT_EQ(errors.largest(), 2.5);
  EXPECT_EQ(errors.values().size(), 3U);
  EXPECT_EQ(ErrorColumn().largest(), 0);
}

TEST(ErrorColumn, WidensAStretchAndLeavesACopyAsItWas) {
  ErrorColumn errors;
  errors.assign(4, 1);
  errors.push_back(3);
  const ErrorColumn before = errors;
  errors.widen(1, 4, 2);
  EXPECT_EQ(errors.values(), (std::vector<double>{1, 2, 2, 2, 3})) << "none gets smaller";
  EXPECT_EQ(before.values(), (std::vector<double>{1, 1, 1, 1, 3}));
}

}  // namespace
}  // namespace emtb
