#include "paper/text.h"

#include <gtest/gtest.h>

#include "hal/error.h"

namespace emtb::paper {
namespace {

TEST(Text, NumbersAreWrittenOut) {
  EXPECT_EQ(number(0.0000604, 1), "0.00006");
  EXPECT_EQ(number(32154.0, 2), "32000");
  EXPECT_EQ(number(31.825, 5), "31.825");
  EXPECT_EQ(number(9.996, 3), "10");
  EXPECT_EQ(number(-0.0547), "-0.0547");
  EXPECT_EQ(number(0), "0");
}

TEST(Text, ErrorsDecideHowManyDigitsAreShown) {
  EXPECT_EQ(with_error(31.7487, 0.078), "31.75 ± 0.08");
  EXPECT_EQ(with_error(0.067118, 0.00014), "0.06712 ± 0.00014");
  EXPECT_EQ(with_error(120, 7), "120 ± 7");
  EXPECT_EQ(with_error(31.825, 0), "31.825");
}

TEST(Text, ChangesCarryTheirSign) {
  EXPECT_EQ(change(1, 1.275), "+27.5 %");
  EXPECT_EQ(change(2, 1, 2), "-50 %");
}

TEST(Text, PlacesAndValuesMustMatch) {
  Markdown md;
  md.heading(1, "Title");
  md.say("a = {}.", {"1"});
  md.bullet("b");
  md.table({{"x", "y"}, {"1", "2"}});
  EXPECT_EQ(md.text(), "# Title\n\na = 1.\n\n- b\n\n| x | y |\n|---|---:|\n| 1 | 2 |\n");
  EXPECT_THROW(md.say("{} {}", {"1"}), Error);
  EXPECT_THROW(md.say("{}", {"1", "2"}), Error);
}

}  // namespace
}  // namespace emtb::paper
