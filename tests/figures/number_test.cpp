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

TEST(Printed, SetsALetterBeforeAUnitThatTakesOne) {
  EXPECT_EQ(printed(0.0529, "V", 3), "52.9 mV");
  EXPECT_EQ(printed(0.15, "V", 3), "0.15 V") << "150 mV does not read better";
  EXPECT_EQ(printed(2e-6, "A", 3), "2 µA");
  EXPECT_EQ(printed(0.0021, "N m", 3), "2.1 mN m");
  EXPECT_EQ(printed(-0.014, "rad/s", 3), "−14 mrad/s");
  EXPECT_EQ(printed(25000, "rad/s", 3), "25000 rad/s") << "nobody counts kilorads";
  EXPECT_EQ(printed(0.00345, "kg m²", 3), "0.00345 kg m²") << "it has its k already";
  EXPECT_EQ(printed(0.5, "", 3), "0.5");
  EXPECT_EQ(printed(std::nan(""), "V", 3), "– V");
}

TEST(Printed, TellsTheEndsOfARangeApart) {
  EXPECT_EQ(printed_range(20.47, 23.83), "20.5 … 23.8");
  EXPECT_EQ(printed_range(0.054655, 0.054721), "0.054655 … 0.054721");
  EXPECT_EQ(printed_range(-3.9, 1), "−3.9 … 1.0");
}

}  // namespace
}  // namespace emtb
