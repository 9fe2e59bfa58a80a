#include "report/progress.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

namespace emtb {
namespace {

/// A file in the place of a terminal.
class Screen {
 public:
  std::FILE* file() { return file_.get(); }

  /// What was written since it was last asked.
  std::string text() {
    std::fflush(file_.get());
    std::fseek(file_.get(), read_, SEEK_SET);
    std::string all;
    for (int c = std::fgetc(file_.get()); c != EOF; c = std::fgetc(file_.get())) all += static_cast<char>(c);
    read_ = std::ftell(file_.get());
    return all;
  }

  /// How long the bar is that is shown now.
  long length() {
    const std::string now = text();
    return std::ranges::count(now, '=');
  }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{std::tmpfile(), std::fclose};
  long read_ = 0;
};

TEST(Progress, NeverGoesBack) {
  Screen screen;
  Progress progress(screen.file(), true);
  long before = 0;
  for (const double share : {0.02, 0.1, 0.25, 0.7, 0.55, 0.6, 0.85, 0.8, 1.0}) {  // as a diagnosis of four effects said
    progress.show(share, "working");
    const long now = screen.length();
    EXPECT_GE(now, before) << share;
    before = now;
  }
  EXPECT_EQ(before, 30) << "the whole bar";
}

TEST(Progress, BeginsAnewOnceItWasTakenAway) {
  Screen screen;
  Progress progress(screen.file(), true);
  progress.show(0.9, "first");
  progress.clear();
  screen.text();
  progress.show(0.1, "second");
  EXPECT_EQ(screen.length(), 3);
}

TEST(Progress, SaysNothingToAPipe) {
  Screen screen;
  {
    Progress progress(screen.file(), false);
    progress.show(0.5, "working");
  }
  EXPECT_EQ(screen.text(), "");
}

}  // namespace
}  // namespace emtb
