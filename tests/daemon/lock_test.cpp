#include "daemon/lock.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>

#include "tests/session/scratch.h"

namespace emtb {
namespace {

using testing::HasSubstr;

class LockTest : public Scratch {};

TEST_F(LockTest, IsHeldByOneAndFreeAfterwards) {
  const auto file = write("bench.yaml", "");
  std::optional<PathLock> first(std::in_place, file, "bench");
  EXPECT_THAT(message_of<Error>([&] { PathLock(file, "bench"); }), HasSubstr("another emtbd uses this bench"));
  first.reset();
  EXPECT_NO_THROW(PathLock(file, "bench"));
}

TEST_F(LockTest, LocksFoldersAndLeavesNothingInThem) {
  const auto folder = path("");
  const PathLock lock(folder, "data folder");
  EXPECT_THROW(PathLock(folder, "data folder"), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(LockTest, SaysWhatCannotBeOpened) {
  EXPECT_THAT(message_of<Error>([&] { PathLock(path("none"), "bench"); }),
              HasSubstr("none: the bench cannot be opened"));
}

}  // namespace
}  // namespace emtb
