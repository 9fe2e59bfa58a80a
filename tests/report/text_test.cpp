#include "report/text.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Table, ACellStaysInItsRow) {
  Table table({"a\tb"});
  table.row({"c\nd"});
  EXPECT_EQ(table.text(), "a?b\nc?d\n");
}

TEST(Pretty, WritesPowersOfTenOnlyWhereDigitsWouldBeTooMany) {
  EXPECT_EQ(pretty(99.6, 2), "100");
  EXPECT_EQ(pretty(1234, 2), "1200");
  EXPECT_EQ(pretty(-123456, 3), "-123000");
  EXPECT_EQ(pretty(2.3e9, 2), "2.3e+09");
  EXPECT_EQ(pretty(0.0547, 2), "0.055");
}

TEST(Counted, OneIsNoPlural) {
  EXPECT_EQ(counted(1, "run"), "1 run");
  EXPECT_EQ(counted(0, "run"), "0 runs");
}

TEST(Wrapped, BreaksAtSpacesAndKeepsTheMargin) {
  EXPECT_EQ(wrapped("one two three", 9, 2), "  one two\n  three");
  EXPECT_EQ(wrapped("a-word-longer-than-a-line x", 9), "a-word-longer-than-a-line\nx");
  EXPECT_EQ(wrapped("\xcf\x89\xcf\x89\xcf\x89 four", 8), "\xcf\x89\xcf\x89\xcf\x89 four") << "characters, not bytes";
  EXPECT_EQ(wrapped("", 9), "");
}

TEST(Fitted, BreaksProseAndLeavesTablesAlone) {
  EXPECT_EQ(fitted("one two three four\nname  value  unit of it\n  in here too\n", 12),
            "one two\n  three four\nname  value  unit of it\n  in here\n    too\n");
}

}  // namespace
}  // namespace emtb
