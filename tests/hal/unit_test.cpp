#include "hal/unit.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Unit, OfAPureNumberIsNotShown) {
  EXPECT_EQ(shown_unit("N m"), "N m");
  EXPECT_EQ(shown_unit("1"), "");
  EXPECT_EQ(shown_unit("1/turn"), "1/turn");
  EXPECT_EQ(with_space("N m"), " N m");
  EXPECT_EQ(with_space("1"), "");
  EXPECT_EQ(in_brackets("N m"), " [N m]");
  EXPECT_EQ(in_brackets("1"), "");
}

}  // namespace
}  // namespace emtb
