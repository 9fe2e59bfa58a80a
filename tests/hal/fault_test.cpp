#include "hal/fault.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Faults, EachSaysItsNameAndWhatHappened) {
  for (const Fault fault : all_faults) {
    EXPECT_NE(text(fault).find(": "), std::string_view::npos) << text(fault);
  }
  EXPECT_EQ(text(Fault::none), "no fault");
  EXPECT_EQ(text(static_cast<Fault>(9999)), "unknown fault");
}

TEST(Faults, NumbersNeverChange) {  // sessions recorded years ago hold them
  constexpr std::array<int, 23> numbers{101, 102, 103, 104, 105, 201, 202, 203, 204, 205, 301, 302,
                                        303, 304, 305, 306, 401, 501, 502, 503, 601, 701, 702};
  ASSERT_EQ(all_faults.size(), numbers.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) EXPECT_EQ(static_cast<int>(all_faults[i]), numbers[i]);
  EXPECT_EQ(static_cast<int>(Fault::over_speed), 101);
  EXPECT_EQ(static_cast<int>(Fault::non_finite), 201);
  EXPECT_EQ(static_cast<int>(Fault::device_lost), 301);
  EXPECT_EQ(static_cast<int>(Fault::overrun), 401);
  EXPECT_EQ(static_cast<int>(Fault::recorder_failed), 501);
  EXPECT_EQ(static_cast<int>(Fault::client_lost), 601);
  EXPECT_EQ(static_cast<int>(Fault::terminated), 701);
}

}  // namespace
}  // namespace emtb
