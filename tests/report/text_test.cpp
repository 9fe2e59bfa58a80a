#include "report/text.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Table, ACellStaysInItsRow) {
  Table table({"a\tb"});
  table.row({"c\nd"});
  EXPECT_EQ(table.text(), "a?b\nc?d\n");
}

TEST(Table, ColumnsThatTheLineHasNoRoomForFollowBelow) {
  Table table({"name", "value", "unit", "remark"});
  table.row({"R_a", "31.8", "ohm", ""});
  table.row({"J", "0.012", "kg m2", "fixed"});
  EXPECT_EQ(table.width(), 4U + 2 + 5 + 2 + 5 + 2 + 6);
  const std::string whole = "name  value   unit  remark\nR_a    31.8    ohm\nJ     0.012  kg m2   fixed\n";
  EXPECT_EQ(table.text(), whole);
  EXPECT_EQ(table.text("", table.width()), whole);
  EXPECT_EQ(table.text("", table.width() - 1),
            "name  value   unit\nR_a    31.8    ohm\nJ     0.012  kg m2\nname  remark\nJ      fixed\n")
      << "a row that has nothing to say below is left out there";
  EXPECT_EQ(
      table.text(" ", 1),
      " name  value\n R_a    31.8\n J     0.012\n name   unit\n R_a     ohm\n J     kg m2\n name  remark\n J      "
      "fixed\n")
      << "one column beside the first always has room";
}

TEST(Table, WordsBeginBelowEachOther) {
  Table table({"id", "stage", "equation"}, Table::Align::words);
  table.row({"windage", "shaft", "T = c"});
  EXPECT_EQ(table.text(), "id       stage  equation\nwindage  shaft  T = c\n");
}

TEST(Pretty, WritesPowersOfTenOnlyWhereDigitsWouldBeTooMany) {
  EXPECT_EQ(pretty(99.6, 2), "100");
  EXPECT_EQ(pretty(1234, 2), "1200");
  EXPECT_EQ(pretty(-123456, 3), "-123000");
  EXPECT_EQ(pretty(2.3e9, 2), "2.3e+09");
  EXPECT_EQ(pretty(0.0547, 2), "0.055");
}

TEST(Pretty, APureNumberHasNoUnit) {
  EXPECT_EQ(pretty(0.25, 0.01, "N m"), "0.25 +- 0.01 N m");
  EXPECT_EQ(pretty(0.25, 0.01, "1"), "0.25 +- 0.01");
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
