#include "drivers/serial_meter/meter.h"

#include <gmock/gmock.h>

#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "tests/drivers/device_log.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/drivers/serial_meter/frames.h"
#include "tests/drivers/serial_meter/opened.h"
#include "tests/process.h"

namespace emtb::serial_meter {
namespace {

using ::testing::HasSubstr;

// Meters that talk by themselves.

class Ut61e : public ::testing::Test {
 protected:
  void say(const std::string& what) {
    const std::lock_guard lock(mutex_);
    says_ = what;
  }
  std::string said() {
    const std::lock_guard lock(mutex_);
    return says_;
  }
  void talk() {
    line = std::make_unique<PseudoTerminal>();
    name.stand_for(line->path());
    speaker = std::make_unique<AtTheOtherEnd>([this] {
      line->write(said());
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    });
  }
  void TearDown() override { speaker.reset(); }

  static std::string amperes(const std::string& digits, int status = 0) {
    return es51922_frame('0', digits, '0', status);
  }
  std::string device(const std::string& more = "") const {
    return "driver: serial_meter, port: " + name.path() + ", model: uni_t_ut61e, period: 0.02" + more;
  }

  PortName name;
  std::unique_ptr<PseudoTerminal> line;
  std::unique_ptr<AtTheOtherEnd> speaker;

 private:
  std::mutex mutex_;
  std::string says_ = amperes("00530");
};

TEST_F(Ut61e, DescribesItself) {
  talk();
  const auto meter = opened(device(", range: 10, window: 0.01"));
  ASSERT_EQ(meter->channels().size(), 1U);
  EXPECT_EQ(meter->channels()[0].signal, Signal::i_a);
  EXPECT_EQ(meter->channels()[0].period, 0.02);
  EXPECT_EQ(meter->channels()[0].window, 0.01);
  EXPECT_EQ(meter->channels()[0].lsb, 1e-3) << "the last digit of the 10 A range";
  EXPECT_THAT(meter->channels()[0].source, HasSubstr("meter (UNI-T UT61E, dc_current)"));
}

TEST_F(Ut61e, GivesReadingsWithTimeAndNumber) {
  talk();
  const auto meter = opened(device(", latency: 0.003"));
  DeviceLog log(*meter);
  const MonotonicClock clock;
  ASSERT_TRUE(log.comes_reading(0.530));
  log.begin();
  const double before = clock.now();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 10; }));
  const double after = clock.now();
  EXPECT_LE(log.readings[0].sequence, 1U) << "numbers restart";
  const double ago = 14 * 10 / 19200.0 + 0.003;  // [s] on the wire, and as declared
  for (std::size_t k = 0; k < log.readings.size(); ++k) {
    EXPECT_DOUBLE_EQ(log.readings[k].value, 0.530);
    EXPECT_GE(log.readings[k].time, before - ago - 0.025);
    EXPECT_LE(log.readings[k].time, after - ago);
    if (k == 0) continue;
    EXPECT_GT(log.readings[k].time, log.readings[k - 1].time);
    EXPECT_GT(log.readings[k].sequence, log.readings[k - 1].sequence);
  }
  EXPECT_TRUE(log.faults.empty());
}

TEST_F(Ut61e, ScalesAShuntsVoltageToAmperes) {
  say(es51922_frame('4', "05300", ';'));  // 53.00 mV
  talk();
  const auto meter = opened(device(", function: dc_voltage, scale: 10, offset: 0.1, range: 0.22"));
  EXPECT_DOUBLE_EQ(meter->channels()[0].lsb, 1e-4);
  EXPECT_TRUE(DeviceLog(*meter).comes_reading(0.630));
}

TEST_F(Ut61e, SilenceGivesNoReadingAndLeavesAGap) {
  talk();
  const auto meter = opened(device());
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  say("");
  ASSERT_TRUE(log.comes([&] { return true; }));
  std::this_thread::sleep_for(std::chrono::milliseconds(40));
  log.look();
  const std::size_t before = log.readings.size();
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  log.look();
  EXPECT_EQ(log.readings.size(), before) << "never an old value anew";
  const std::uint64_t last = log.readings.back().sequence;
  say(amperes("00700"));
  ASSERT_TRUE(log.comes_reading(0.700));
  EXPECT_GE(log.readings[before].sequence, last + 8) << "0.3 s of 20 ms are missing";
  EXPECT_TRUE(log.faults.empty()) << "what is stale is for the loop to say";
}

TEST_F(Ut61e, GarbageNeverBecomesAReading) {
  say("");
  talk();
  const auto meter = opened(device());
  DeviceLog log(*meter);
  say(amperes("00530").substr(1) + amperes("00530").substr(0, 9) + "\r\n" + std::string("\x00\xff\x80", 3));
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  log.look();
  EXPECT_TRUE(log.readings.empty());
  say("\r\n\xff" + amperes("00990") + amperes("00700"));
  EXPECT_TRUE(log.comes_reading(0.700));
  for (const Reading& reading : log.readings) EXPECT_NEAR(reading.value, 0.700, 1e-9) << "0.990 had a byte before it";
}

TEST_F(Ut61e, OverloadIsAFaultUntilAReadingComes) {
  talk();
  const auto meter = opened(device());
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  say(amperes("22000", 0b0001));
  ASSERT_TRUE(log.comes_fault(Fault::over_range));
  log.look();
  EXPECT_EQ(log.fault, Fault::over_range) << "it stands";
  for (const Reading& reading : log.readings) EXPECT_DOUBLE_EQ(reading.value, 0.530);
  say(amperes("00700"));
  EXPECT_TRUE(log.comes_reading(0.700));
}

TEST_F(Ut61e, AnotherFunctionOrAHeldDisplayIsAFault) {
  talk();
  const auto meter = opened(device());
  DeviceLog log(*meter);
  for (const std::string& wrong : {es51922_frame('0', "00530", ';'),                              // volts
                                   es51922_frame('0', "00530", '0', 0, 0, 0, 0b0100),             // AC
                                   es51922_frame('0', "00530", '0', 0, 0, 0, 0b1000, 0b0010)}) {  // HOLD
    say(amperes("00530"));
    ASSERT_TRUE(log.comes_reading(0.530));
    log.readings.clear();
    say(wrong);
    EXPECT_TRUE(log.comes_fault(Fault::wrong_function));
  }
}

TEST_F(Ut61e, AFaultThatHasPassedIsSeenOnce) {
  talk();
  const auto meter = opened(device());
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  say(amperes("22000", 0b0001));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  say(amperes("00530"));
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  log.look();
  EXPECT_EQ(log.fault, Fault::over_range) << "a loop that looked away all the while still hears of it";
  log.look();
  EXPECT_EQ(log.fault, Fault::none);
}

TEST_F(Ut61e, APulledAdapterIsAFaultAndComesBack) {
  talk();
  const auto meter = opened(device());
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  speaker->leave();
  line->hang_up();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  log.look();
  EXPECT_EQ(log.fault, Fault::device_lost) << "it stands";
  say(amperes("00810"));
  talk();
  EXPECT_TRUE(log.comes_reading(0.810));
}

TEST(SegmentsOnALine, AreRead) {
  PseudoTerminal line;
  AtTheOtherEnd fs9721([&] {
    line.write(fs9721_frame("0.530", 0b0111, 0, 0, 0, 0b1000));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  const auto meter = opened("driver: serial_meter, port: " + line.path() + ", model: uni_t_ut60e, period: 0.02");
  EXPECT_TRUE(DeviceLog(*meter).comes_reading(0.530));
}

}  // namespace
}  // namespace emtb::serial_meter
