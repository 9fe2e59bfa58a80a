#include "daemon/lock.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

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
  struct stat about {};
  ASSERT_EQ(stat(file.c_str(), &about), 0);
  for (const auto& entry : std::filesystem::directory_iterator(lock_folder())) {
    EXPECT_EQ(entry.path().string().find("-" + std::to_string(about.st_ino) + ".lock"), std::string::npos)
        << "an orderly end leaves nothing behind";
  }
}

TEST_F(LockTest, LocksFoldersAndLeavesNothingInThem) {
  const auto folder = path("");
  const PathLock lock(folder, "data folder");
  EXPECT_THROW(PathLock(folder, "data folder"), Error);
  EXPECT_TRUE(std::filesystem::is_empty(folder));
}

TEST_F(LockTest, WhoeverMayReadTheBenchCannotKeepUsOut) {
  const auto file = write("bench.yaml", "");
  const int theirs = open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const int folder = open(path("").c_str(), O_RDONLY | O_CLOEXEC);
  ASSERT_EQ(flock(theirs, LOCK_EX | LOCK_NB), 0);
  ASSERT_EQ(flock(folder, LOCK_EX | LOCK_NB), 0);
  EXPECT_NO_THROW(PathLock(file, "bench"));
  EXPECT_NO_THROW(PathLock(path(""), "data folder"));
  struct stat about {};
  ASSERT_EQ(stat(lock_folder().c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 0777, 0700U) << "and what is locked instead, they cannot reach";
  close(theirs);
  close(folder);
}

TEST_F(LockTest, SaysWhatCannotBeOpened) {
  EXPECT_THAT(message_of<Error>([&] { PathLock(path("none"), "bench"); }),
              HasSubstr("none: the bench cannot be opened"));
}

}  // namespace
}  // namespace emtb
