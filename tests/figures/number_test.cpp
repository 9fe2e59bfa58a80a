#include "figures/number.h"

#include <gtest/gtest.h>

#include <cmath>

namespace emtb {
namespace {

TEST(Printed, HasAsManyDigitsAsAskedAndNoTrailingZeros) {
  EXPECT_EQ(printed(0.0547), "0.0547");
  EXPECT_EQ(printed(9.9999, 3), "10");
  EXPECT_EQ(printed(-0.25), "−0.25");
  EXPECT_EQ(printed(0), "0");
  EXPECT_EQ(printed(7.34e6, 3), "7.34×10⁶");
  EXPECT_EQ(printed(-2e-5), "−2×10⁻⁵");
  EXPECT_EQ(printed(std::nan("")), "–");
}

TEST(Printed, GivesAValueTheDigitsThatItsErrorIsWorth) {
  EXPECT_EQ(printed(0.0546882, 0.000031), "0.05469 ± 0.00003");
  EXPECT_EQ(printed(31.8188, 0.0123), "31.819 ± 0.012") << "two digits where the first is a 1";
  EXPECT_EQ(printed(-3.4, 0.2), "−3.4 ± 0.2");
  EXPECT_EQ(printed(2.5e-5, 4e-7), "(2.50 ± 0.04)×10⁻⁵");
}

TEST(Printed, TellsTheEndsOfARangeApart) {
  EXPECT_EQ(printed_range(20.47, 23.83), "20.5 … 23.8");
  EXPECT_EQ(printed_range(0.054655, 0.054721), "0.054655 … 0.054721");
  EXPECT_EQ(printed_range(-3.9, 1), "−3.9 … 1.0");
}

}  // namespace
}  // namespace emtb
