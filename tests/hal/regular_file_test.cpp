#include "hal/regular_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <filesystem>

#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;

class RegularFile : public Scratch {
 protected:
  static std::string refusal(const std::filesystem::path& file) {
    return message_of<Error>([&] { read_regular_file(file, 1000, "the path of a .csv"); });
  }
};

TEST_F(RegularFile, IsReadWhole) {
  const std::string text = std::string("a\0b\n", 4) + std::string(996, 'x');
  EXPECT_EQ(read_regular_file(write("a", text), 1000, "a file"), text);
  EXPECT_EQ(read_regular_file(write("empty", ""), 1000, "a file"), "");
  EXPECT_NE(read_regular_file("/proc/self/status", 100'000, "a file"), "") << "which says that its size is 0";
}

TEST_F(RegularFile, WhatNeverEndsOrNeverComesIsRefusedAtOnce) {
  ASSERT_EQ(mkfifo(path("pipe").c_str(), 0600), 0);
  EXPECT_THAT(refusal(path("pipe")),
              HasSubstr("pipe: is a pipe or a device, no file that ends. Give the path of a .csv"));
  EXPECT_THAT(refusal("/dev/zero"), HasSubstr("is a pipe or a device"));
  EXPECT_THAT(refusal(path("")), HasSubstr("is a folder"));
  EXPECT_THAT(refusal(path("none")), HasSubstr("cannot be read: no such file"));
}

TEST_F(RegularFile, WhatIsTooLargeIsRefusedUnread) {
  EXPECT_THAT(refusal(write("long", std::string(1001, 'x'))), HasSubstr("is larger than 1000 bytes"));
  write("sparse", "");
  std::filesystem::resize_file(path("sparse"), std::uintmax_t{1} << 40);
  EXPECT_THAT(message_of<Error>([&] { read_regular_file(path("sparse"), std::uint64_t{2} << 30, "a file"); }),
              HasSubstr("is larger than 2 GiB"));
}

}  // namespace
}  // namespace emtb
