#include "drivers/program/line_feed.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

namespace emtb::program {
namespace {

using testing::ElementsAre;

struct Taken {
  std::vector<std::string> lines;
  std::size_t too_long = 0;

  bool feed(LineFeed& feed, std::string_view bytes, double now = 1) {
    return feed.feed(bytes, now, [this](const LineFeed::Line& line) {
      lines.emplace_back(line.text);
      too_long += line.too_long ? 1 : 0;
    });
  }
};

TEST(LineFeed, PutsLinesTogetherHoweverTheyArrive) {
  LineFeed feed(100);
  Taken taken;
  EXPECT_TRUE(taken.feed(feed, "i_a=1\r\nome"));
  EXPECT_TRUE(taken.feed(feed, "ga=2\n\nt"));
  EXPECT_THAT(taken.lines, ElementsAre("i_a=1", "omega=2", ""));
  EXPECT_EQ(taken.too_long, 0U);
}

TEST(LineFeed, KeepsNoMoreOfALongLineThanItsBeginning) {
  LineFeed feed(100'000);
  Taken taken;
  for (int part = 0; part < 1000; ++part) EXPECT_TRUE(taken.feed(feed, std::string(1000, '7')));
  EXPECT_TRUE(taken.lines.empty());
  EXPECT_TRUE(taken.feed(feed, "\nomega=2\n"));
  EXPECT_EQ(taken.too_long, 1U);
  EXPECT_THAT(taken.lines, ElementsAre(std::string(LineFeed::longest_line, '7'), "omega=2"));
}

TEST(LineFeed, CallsMoreLinesThanAgreedWithinASecondAFlood) {
  LineFeed feed(3);
  Taken taken;
  EXPECT_TRUE(taken.feed(feed, "1\n2\n3\n", 10));
  EXPECT_TRUE(taken.feed(feed, "4\n5\n6\n", 11)) << "in the next second";
  EXPECT_FALSE(taken.feed(feed, "7\n", 11.9));
  EXPECT_EQ(taken.lines.size(), 6U);
}

TEST(LineFeed, CallsALineWithoutAnEndAFloodAsWell) {
  LineFeed feed(10);
  Taken taken;
  bool good = true;
  for (int part = 0; part < 100 && good; ++part) good = taken.feed(feed, std::string(100, 'x'));
  EXPECT_FALSE(good);
}

}  // namespace
}  // namespace emtb::program
