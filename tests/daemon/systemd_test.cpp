#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

const char* const analyze = "/usr/bin/systemd-analyze";

/// The unit as shipped, looked at by systemd's own tool; needs no systemd that runs.
class Unit : public Scratch {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists(analyze)) GTEST_SKIP() << analyze << " is missing (package systemd)";
  }
  std::string text() const { return read(std::filesystem::path(EMTB_SYSTEMD) / "emtbd.service"); }
  /// The unit with our program in the place of the installed one, which verify would miss.
  std::filesystem::path unit() const {
    std::string changed = text();
    const std::string installed = "/usr/bin/emtbd";
    for (auto at = changed.find(installed); at != std::string::npos; at = changed.find(installed, at + 1)) {
      changed.replace(at, installed.size(), EMTBD);
    }
    return write("emtbd.service", changed);
  }
};

TEST_F(Unit, IsUnderstoodBySystemd) {
  Process verify({analyze, "verify", unit()}, path("verify"));
  EXPECT_EQ(verify.wait(), 0) << verify.err();
  EXPECT_THAT(verify.err(), testing::Not(testing::HasSubstr("emtbd.service:"))) << "no line that it does not know";
}

TEST_F(Unit, ExposesLittle) {
  Process security({analyze, "security", "--offline=true", "--threshold=40", "--no-pager", unit()}, path("security"));
  EXPECT_EQ(security.wait(), 0) << security.out() << security.err();
  EXPECT_THAT(security.out(), testing::HasSubstr("Overall exposure level"));
}

TEST_F(Unit, LeavesRealTimeAndTheBenchsDevicesAlone) {
  using testing::HasSubstr;
  const std::string unit_text = text();
  for (const char* needed :
       {"LimitRTPRIO=80", "LimitMEMLOCK=infinity", "char-usb_device rw", "char-ttyUSB rw", "char-comedi rw",
        "char-hidraw rw", "/dev/cpu_dma_latency rw", "mlockall", "sched_setscheduler", "sched_setaffinity"}) {
    EXPECT_THAT(unit_text, HasSubstr(needed));
  }
  for (const char* forbidden : {"RestrictRealtime=yes", "PrivateDevices=yes", "PrivateUsers=yes"}) {
    EXPECT_THAT(unit_text, testing::Not(HasSubstr(forbidden)));
  }
  EXPECT_THAT(unit_text, HasSubstr("ExecStopPost=/usr/bin/emtbd --config /etc/emtb/bench.yaml --safe"));
}

}  // namespace
}  // namespace emtb
