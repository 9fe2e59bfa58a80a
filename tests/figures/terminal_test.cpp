#include "figures/terminal.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sstream>

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::Not;

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::stringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

std::size_t columns_of(const std::string& line) {
  return static_cast<std::size_t>(std::ranges::count_if(line, [](char c) { return (c & 0xC0) != 0x80; }));
}

Figure rising(Pen pen = {}) {
  Figure f;
  f.x({"t", "s"}).panel({"ω", "rad/s"}).line("speed", {0, 10}, {0, 100}, pen);
  return f;
}

TEST(Terminal, DrawsARisingLineFromTheLowerLeftToTheUpperRight) {
  const auto lines = lines_of(to_terminal(rising(), {.width = 60, .lines = 10}));
  ASSERT_EQ(lines.size(), 1U + 10 + 3) << "heading, rows, axis, its labels and title";
  EXPECT_THAT(lines[0], testing::AllOf(HasSubstr("ω [rad/s]"), HasSubstr("speed")));
  std::size_t before = 1000;
  for (std::size_t row = 1; row <= 10; ++row) {  // from the top down, the line begins further left in each row
    const std::size_t axis = std::min(lines[row].find("│"), lines[row].find("┤"));
    ASSERT_NE(axis, std::string::npos);
    const std::size_t first = lines[row].find_first_not_of(' ', axis + 3);
    ASSERT_NE(first, std::string::npos) << "a row without the line: " << lines[row];
    EXPECT_LT(first, before);
    before = first;
  }
  EXPECT_THAT(lines[12], testing::AllOf(HasSubstr("0"), HasSubstr("10")));
  EXPECT_THAT(lines[13], HasSubstr("t [s]"));
}

TEST(Terminal, StaysWithinItsWidth) {
  for (const int width : {40, 80, 133}) {
    for (const std::string& line : lines_of(to_terminal(rising(), {.width = width})))
      EXPECT_LE(columns_of(line), static_cast<std::size_t>(width)) << line;
  }
}

TEST(Terminal, IsColouredOnlyWhereAsked) {
  EXPECT_THAT(to_terminal(rising({Ink::blue})), Not(HasSubstr("\033")));
  EXPECT_THAT(to_terminal(rising({Ink::blue}), {.colour = true}), HasSubstr("\033[34m"));
}

TEST(Terminal, LeavesGapsWhereNothingWasRead) {
  const double unread = std::nan("");
  Figure f;
  f.x({"t", "s"}).panel({"y", ""}).line("", {0, 1, 2, 3, 4, 5}, {1, 1, unread, unread, 1, 1});
  const auto lines = lines_of(to_terminal(f, {.width = 63, .lines = 3}));
  const auto row = std::ranges::find_if(lines, [](const std::string& line) {
    return line.find("\xE2\xA0") < line.size() || line.find("\xE2\xA1") < line.size();
  });
  ASSERT_NE(row, lines.end());
  EXPECT_THAT(*row, HasSubstr("                         ")) << "of 60 columns, 36 lie between the two pieces";
}

}  // namespace
}  // namespace emtb
