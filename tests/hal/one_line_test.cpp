#include "hal/one_line.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(OneMessage, IsOneLineThatAPersonReads) {
  EXPECT_EQ(in_one_line("a\nb"), "a?b");
  const std::string cut = in_one_line(std::string(999, 'x') + "\xc3\xb6" + std::string(200'000, 'y'));
  EXPECT_EQ(cut, std::string(999, 'x') + " ...");
}

}  // namespace
}  // namespace emtb
