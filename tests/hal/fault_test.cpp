#include "hal/fault.h"

#include <gtest/gtest.h>

namespace emtb {
namespace {

TEST(Faults, EachSaysItsNameAndWhatHappened) {
  for (const Fault fault :
       {Fault::over_speed, Fault::over_current, Fault::over_torque, Fault::run_too_long, Fault::non_finite,
        Fault::stale_signal, Fault::over_range, Fault::device_lost, Fault::output_failed, Fault::wrong_function,
        Fault::samples_lost, Fault::scan_broken, Fault::overrun, Fault::recorder_failed, Fault::recorder_behind,
        Fault::client_lost, Fault::terminated}) {
    EXPECT_NE(text(fault).find(": "), std::string_view::npos) << text(fault);
  }
  EXPECT_EQ(text(Fault::none), "no fault");
  EXPECT_EQ(text(static_cast<Fault>(9999)), "unknown fault");
}

TEST(Faults, NumbersNeverChange) {  // sessions recorded years ago hold them
  EXPECT_EQ(static_cast<int>(Fault::over_speed), 101);
  EXPECT_EQ(static_cast<int>(Fault::non_finite), 201);
  EXPECT_EQ(static_cast<int>(Fault::device_lost), 301);
  EXPECT_EQ(static_cast<int>(Fault::samples_lost), 304);
  EXPECT_EQ(static_cast<int>(Fault::scan_broken), 305);
  EXPECT_EQ(static_cast<int>(Fault::overrun), 401);
  EXPECT_EQ(static_cast<int>(Fault::recorder_failed), 501);
  EXPECT_EQ(static_cast<int>(Fault::client_lost), 601);
  EXPECT_EQ(static_cast<int>(Fault::terminated), 701);
}

}  // namespace
}  // namespace emtb
