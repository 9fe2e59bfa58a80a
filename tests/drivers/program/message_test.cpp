#include "drivers/program/message.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace emtb::program {
namespace {

TEST(ProgramMessage, AHelloHasAVersionAndAName) {
  const auto hello = read_hello("emtb 1 OWON,XDM1041 \x1b[31m");
  ASSERT_TRUE(hello);
  EXPECT_EQ(hello->version, 1);
  EXPECT_EQ(hello->name, "OWON,XDM1041 ?[31m");
  EXPECT_TRUE(read_hello("emtb 2"));
  for (const char* line : {"", "emtb", "emtb x", "Hello", "emtb1 x", "1 emtb"}) EXPECT_FALSE(read_hello(line)) << line;
}

TEST(ProgramMessage, AReportGivesSignalsTimeAndOutput) {
  const auto report = read_report("  omega=-80.5 t=12.25  i_a=1e-3 out=2 ");
  ASSERT_TRUE(report);
  ASSERT_EQ(report->count, 2U);
  EXPECT_EQ(report->values[0].signal, Signal::omega);
  EXPECT_DOUBLE_EQ(report->values[0].value, -80.5);
  EXPECT_EQ(report->values[1].signal, Signal::i_a);
  EXPECT_DOUBLE_EQ(report->values[1].value, 1e-3);
  EXPECT_EQ(report->time, 12.25);
  EXPECT_EQ(report->out, 2);
  EXPECT_TRUE(std::isnan(read_report("omega=nan")->values[0].value)) << "the driver makes a fault of it";
}

TEST(ProgramMessage, AnythingElseIsNoReport) {
  for (const char* line :
       {"", " ", "omega", "omega=", "omega=x", "omega=1x", "omega=1,5", "omega = 1", "speed=1", "omega=1 omega=2",
        "t=1 t=2", "t=nan", "out=inf", "=1", "omega=1 hello", "OMEGA=1", "omega=0x10", "omega=+1"}) {
    EXPECT_FALSE(read_report(line)) << line;
  }
}

TEST(ProgramMessage, AFaultIsOneOfThoseThatADeviceHas) {
  EXPECT_EQ(read_fault("fault over_range"), Fault::over_range);
  EXPECT_EQ(read_fault("fault wrong_function"), Fault::wrong_function);
  for (const char* line : {"fault", "fault overrun", "fault over_range now", "over_range", "fault none"}) {
    EXPECT_FALSE(read_fault(line)) << line;
  }
}

TEST(ProgramMessage, ASetLineIsReadBackAsTheSameNumber) {
  EXPECT_EQ(set_line(1.25), "set 1.25\n");
  EXPECT_EQ(set_line(-0.001), "set -0.001\n");
  EXPECT_NEAR(std::stod(set_line(M_PI).substr(4)), M_PI, 1e-8);
}

TEST(ProgramMessage, NoLineWhateverDoesHarm) {
  std::mt19937 random(3);
  const std::string letters =
      "omegaitu=._-+0123456789 e\x00\xff\x1b"
      "nf";
  std::size_t reports = 0;
  for (int n = 0; n < 20'000; ++n) {
    std::string line = n % 2 == 0 ? "" : "omega=";
    for (std::size_t k = random() % 20; k > 0; --k) line += letters[random() % letters.size()];
    reports += read_report(line) ? 1 : 0;
    read_hello(line);
    read_fault(line);
  }
  EXPECT_GT(reports, 100U) << "some are good by chance";
}

}  // namespace
}  // namespace emtb::program
