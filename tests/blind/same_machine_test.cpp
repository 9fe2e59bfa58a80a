/// A few of the cases that `discover_judge` counts (docs/discover.md), so that what it found it still finds.
#include "tests/blind/same_machine.h"

#include <gtest/gtest.h>

namespace emtb::blind {
namespace {

std::size_t found_of(MachineKind kind, std::initializer_list<std::size_t> numbers) {
  std::size_t found = 0;
  for (const std::size_t number : numbers) {
    const MachineAnswer a = ask(make_machine_case(kind, number, 1));
    EXPECT_TRUE(a.visible) << name_of(kind) << ":" << number;
    EXPECT_FALSE(a.otherwise) << name_of(kind) << ":" << number << a.said;
    found += a.found ? 1 : 0;
  }
  return found;
}

TEST(SameMachineBlind, AChangedParameterIsFoundWhereAnOracleSeesIt) {
  EXPECT_EQ(found_of(MachineKind::changed, {0, 2, 5}), 3U);
}

TEST(SameMachineBlind, ADisturbanceIsFoundWhereAnOracleSeesIt) {
  EXPECT_EQ(found_of(MachineKind::disturbed, {2, 4}), 2U);
}

TEST(SameMachineBlind, NothingIsSaidOfHealthyRuns) {
  for (const std::size_t number : {3U, 4U, 10U}) {
    const MachineAnswer a = ask(make_machine_case(MachineKind::healthy, number, 1));
    EXPECT_FALSE(a.law_offered || a.change_named || a.disturbance_named) << number << a.said;
  }
}

TEST(SameMachineBlind, IntervalsAreWilsons) {
  EXPECT_EQ(counted_with_interval(17, 20), "17 of 20 (64 to 95 %)");
  EXPECT_EQ(counted_with_interval(0, 0), "0 of 0");
}

}  // namespace
}  // namespace emtb::blind
