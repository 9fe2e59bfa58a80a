#include "analysis/numerics/parallel.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <mutex>
#include <stdexcept>
#include <vector>

namespace emtb {
namespace {

TEST(ParallelFor, CallsEachPlaceOnce) {
  std::vector<std::atomic<int>> calls(1000);
  parallel_for(calls.size(), [&](std::size_t i) { ++calls[i]; });
  for (std::size_t i = 0; i < calls.size(); ++i) ASSERT_EQ(calls[i], 1) << i;
}

TEST(ParallelFor, PassesAnExceptionOn) {
  const auto fails_at_7 = [](std::size_t i) {
    if (i == 7) throw std::runtime_error("seven");
  };
  EXPECT_THROW(parallel_for(20, fails_at_7), std::runtime_error);
}

struct Item {
  double seconds = 0;
  double length() const { return seconds; }
};

/// The longest come first, but which call is seen first depends on the machine.
TEST(ParallelFor, CallsEachItemOnceWhateverItsLength) {
  const std::vector<Item> items{{1}, {5}, {9}, {2}};
  std::mutex mutex;
  std::vector<std::size_t> taken;
  parallel_for(items, [&](std::size_t i) {
    const std::lock_guard lock(mutex);
    taken.push_back(i);
  });
  ASSERT_EQ(taken.size(), items.size());
  std::ranges::sort(taken);
  EXPECT_EQ(taken, (std::vector<std::size_t>{0, 1, 2, 3}));
}

TEST(AtOnce, CallsEachFunctionOnce) {
  std::array<std::atomic<int>, 3> calls{};
  at_once([&] { ++calls[0]; }, [&] { ++calls[1]; }, [&] { ++calls[2]; });
  for (const std::atomic<int>& of : calls) EXPECT_EQ(of, 1);
}

TEST(EachOnACore, SharesOutNoWorkOfItsOwnButThatOfASingleOne) {
  std::vector<char> alone(2);
  each_on_a_core(alone.size(), [&](std::size_t i) { alone[i] = OneThreadHere::on(); });
  EXPECT_EQ(alone, (std::vector<char>{1, 1}));
  each_on_a_core(1, [&](std::size_t i) { alone[i] = OneThreadHere::on(); });
  EXPECT_FALSE(alone[0]);
}

}  // namespace
}  // namespace emtb
