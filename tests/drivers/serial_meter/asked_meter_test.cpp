#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/serial_meter/meter.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/drivers/serial_meter/frames.h"
#include "tests/drivers/serial_meter/opened.h"
#include "tests/process.h"

namespace emtb::serial_meter {
namespace {

// Meters that are asked: by words, behind prompts, by one byte.

/// An Agilent 34401A as its manual describes it, and a meter that misbehaves in the ways of its `mood`.
class Agilent : public ::testing::Test {
 protected:
  enum class Mood { well, silent, late, turned, overloaded, mumbling };

  void answer() {
    pending_ += line->read(0.005);
    for (std::size_t end = pending_.find('\n'); end != std::string::npos; end = pending_.find('\n')) {
      std::string text = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      std::erase(text, '\x03');
      execute(text);
    }
  }
  void execute(const std::string& command) {
    {
      const std::lock_guard lock(mutex_);
      commands_.push_back(command);
    }
    const Mood now = mood;
    if (now == Mood::silent) return;
    if (command.starts_with("CONF:")) function_ = command.substr(5, 4);
    if (command == "READ?") {
      if (now == Mood::late) std::this_thread::sleep_for(std::chrono::milliseconds(450));
      if (now == Mood::mumbling) line->write("+5.3x\r\n+5.3");
      line->write(now == Mood::overloaded ? "+9.90000000E+37\r\n"
                  : now == Mood::late     ? "+7.77000000E-01\r\n"
                                          : "+5.30000000E-01\r\n");
    }
    if (command == "SYST:ERR?") line->write("+0,\"No error\"\r\n");
    if (command == "FUNC?") line->write(now == Mood::turned ? "\"VOLT\"\r\n" : "\"" + function_ + "\"\r\n");
  }
  void connect() {
    line = std::make_unique<PseudoTerminal>();
    name.stand_for(line->path());
    other_end = std::make_unique<AtTheOtherEnd>([this] { answer(); });
    if (!meter)
      meter = opened("driver: serial_meter, port: " + name.path() +
                     ", model: agilent_34401a, range: 3, period: 0.03, timeout: 0.25");
  }
  bool was_told(const std::string& command) {
    const std::lock_guard lock(mutex_);
    return std::ranges::find(commands_, command) != commands_.end();
  }
  void TearDown() override {
    meter.reset();
    other_end.reset();
  }

  std::atomic<Mood> mood = Mood::well;
  PortName name;
  std::unique_ptr<PseudoTerminal> line;
  std::unique_ptr<AtTheOtherEnd> other_end;
  std::unique_ptr<InputDevice> meter;

 private:
  std::mutex mutex_;
  std::vector<std::string> commands_;
  std::string pending_;
  std::string function_ = "VOLT";
};

TEST_F(Agilent, IsSetUpAndAsked) {
  connect();
  DeviceLog log(*meter);
  EXPECT_TRUE(log.comes_reading(0.530));
  EXPECT_TRUE(was_told("SYST:REM"));
  EXPECT_TRUE(was_told("CONF:CURR:DC 3"));
  EXPECT_TRUE(was_told("CURR:DC:NPLC 10"));
  EXPECT_DOUBLE_EQ(meter->channels()[0].lsb, 9e-7);
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 5; }));
  EXPECT_TRUE(log.faults.empty());
}

TEST_F(Agilent, SilenceIsOvercomeByAskingAnew) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  mood = Mood::silent;
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  log.look();
  const std::size_t before = log.readings.size();
  std::this_thread::sleep_for(std::chrono::milliseconds(200));
  log.look();
  EXPECT_EQ(log.readings.size(), before);
  mood = Mood::well;
  EXPECT_TRUE(log.comes([&] { return log.readings.size() > before; }));
}

TEST_F(Agilent, ALateAnswerIsNoReading) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  mood = Mood::late;
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  mood = Mood::well;
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const std::size_t before = log.readings.size();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > before + 3; }));
  for (const Reading& reading : log.readings)
    EXPECT_DOUBLE_EQ(reading.value, 0.530) << "0.777 was asked for long before";
}

TEST_F(Agilent, OverloadAndAnotherFunctionAreFaults) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  mood = Mood::overloaded;
  EXPECT_TRUE(log.comes_fault(Fault::over_range));
  mood = Mood::turned;
  EXPECT_TRUE(log.comes_fault(Fault::wrong_function));
  mood = Mood::well;
  EXPECT_TRUE(log.comes_reading(0.530));
}

TEST_F(Agilent, GarbageBetweenAnswersIsPassedOver) {
  mood = Mood::mumbling;
  connect();
  DeviceLog log(*meter);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  mood = Mood::well;
  EXPECT_TRUE(log.comes_reading(0.530));
  for (const Reading& reading : log.readings) EXPECT_DOUBLE_EQ(reading.value, 0.530);
}

TEST_F(Agilent, APulledAdapterIsAFaultAndTheMeterIsSetUpAgain) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  other_end->leave();
  line->hang_up();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  connect();
  EXPECT_TRUE(log.comes_reading(0.530));
}

/// A Fluke 45 as its manual describes it, its echo on.
class FlukeOnALine : public ::testing::Test {
 protected:
  void answer() {
    for (const char c : line.read(0.005)) {
      if (c == '\x03') {
        pending_.clear();
        line.write("\r\n=>\r\n");
      } else {
        pending_ += c;
      }
    }
    const std::size_t end = pending_.find('\r');
    if (end == std::string::npos) return;
    const std::string command = pending_.substr(0, end);
    pending_.erase(0, end + 1);
    if (!pending_.empty()) spoken_over = true;
    const bool slow = late;
    line.write(command + "\r\n");
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    const std::string more = line.read(0);
    if (!more.empty()) spoken_over = true;
    pending_ += more;
    if (command == "MEAS1?") {
      if (slow) std::this_thread::sleep_for(std::chrono::milliseconds(700));
      line.write(slow ? "+7.770E-1 ADC\r\n" : "+5.301E-1 ADC\r\n");
    }
    line.write(command == "RATE S" ? "!>\r\n" : "=>\r\n");
  }
  void TearDown() override {
    meter.reset();
    other_end.leave();
  }

  std::atomic<bool> spoken_over = false;
  std::atomic<bool> late = false;
  PseudoTerminal line;

 private:
  std::string pending_;

 protected:
  AtTheOtherEnd other_end{[this] { answer(); }};
  std::unique_ptr<InputDevice> meter =
      opened("driver: serial_meter, port: " + line.path() + ", model: fluke_45, period: 0.02, timeout: 0.25");
};

TEST_F(FlukeOnALine, IsNotSpokenToBeforeItsPrompt) {
  DeviceLog log(*meter);
  EXPECT_TRUE(log.comes_reading(0.5301));
  EXPECT_TRUE(log.comes([&] { return log.readings.size() >= 5; }));
  EXPECT_FALSE(spoken_over);
}

TEST_F(FlukeOnALine, ALateAnswerIsNoReading) {
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.5301));
  late = true;
  log.look_for(2.5);
  late = false;
  const std::size_t before = log.readings.size();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= before + 3; }));
  for (const Reading& reading : log.readings)
    EXPECT_DOUBLE_EQ(reading.value, 0.5301) << "0.777 was asked for long before";
}

TEST(MetexOnALine, IsAskedByOneByte) {
  PseudoTerminal line;
  AtTheOtherEnd metex([&] {
    for (const char c : line.read(0.005)) {
      if (c == 'D') line.write(metex_frame("DC", "0.5300", "A"));
    }
  });
  const auto meter =
      opened("driver: serial_meter, port: " + line.path() + ", model: metex_m4650cr, period: 0.02, range: 20");
  EXPECT_EQ(meter->channels()[0].lsb, 1e-3);
  EXPECT_TRUE(DeviceLog(*meter).comes_reading(0.530));
}

}  // namespace
}  // namespace emtb::serial_meter
