#include "hal/printable.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Printable, NoTextMovesTheCursorOrEndsTheLine) {
  EXPECT_EQ(printable("a note\n  event 101 at 2 s: over_speed\x1b[31m"), "a note?  event 101 at 2 s: over_speed?[31m");
  EXPECT_EQ(printable("gr\xc3\xb6\xc3\x9f"
                      "er \xce\xa9"),
            "gr\xc3\xb6\xc3\x9f"
            "er \xce\xa9");
  EXPECT_EQ(printable("\xc2\x9b"
                      "31m"),
            "??31m")
      << "CSI in one character";
  EXPECT_EQ(printable(std::string("a\0b", 3)), "a?b");
}

}  // namespace
}  // namespace emtb
