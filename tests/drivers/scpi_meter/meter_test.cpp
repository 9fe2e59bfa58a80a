#include <gmock/gmock.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "drivers/scpi_meter/open.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/pseudo_terminal.h"

namespace emtb::scpi_meter {
namespace {

using testing::HasSubstr;

BenchConfig bench_of(const std::string& device) {
  return parse_bench(
      "name: b\nreference: {device: meter, min: 0, max: 6, safe: 0}\ndevices:\n  meter: {driver: "
      "scpi_meter, " +
          device + "}\n",
      "b.yaml");
}

std::unique_ptr<InputDevice> opened(const std::string& device) {
  const BenchConfig bench = bench_of(device);
  return open_meter({.bench = bench,
                     .device = bench.devices[0],
                     .clock = std::make_shared<MonotonicClock>(),
                     .world = nullptr})
      .input;
}

/// A meter that nobody has heard of, and the ways in which it misbehaves.
class UnknownMeter : public ::testing::Test {
 protected:
  enum class Mood { well, silent, late, turned, overloaded, mumbling };

  void answer() {
    pending_ += line->read(0.005);
    for (std::size_t end = pending_.find("\r\n"); end != std::string::npos; end = pending_.find("\r\n")) {
      const std::string text = pending_.substr(0, end);
      pending_.erase(0, end + 2);
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
    if (command == "*IDN?") line->write("NOBODY,METER 7,0,1.0\r\n");
    if (command == "MODE?") line->write(now == Mood::turned ? "VOLT AC\r\n" : "CURR DC\r\n");
    if (command != "FETCH?") return;
    if (now == Mood::late) std::this_thread::sleep_for(std::chrono::milliseconds(450));
    if (now == Mood::mumbling) line->write("ch1;+5.x;mA\r\n\r\n" + std::string(500, '9') + "\r\n");
    line->write(now == Mood::overloaded ? "ch1;+9.9E37;mA\r\n"
                : now == Mood::late     ? "ch1;+777;mA\r\n"
                                        : "ch1;+530;mA\r\n");
  }
  void connect() {
    line = std::make_unique<PseudoTerminal>();
    name.stand_for(line->path());
    other_end = std::make_unique<AtTheOtherEnd>([this] { answer(); });
    if (!meter) meter = opened(keys + ", port: " + name.path());
  }
  bool was_told(const std::string& command) {
    const std::lock_guard lock(mutex_);
    return std::ranges::find(commands_, command) != commands_.end();
  }
  void TearDown() override {
    meter.reset();
    other_end.reset();
  }

  std::string keys =
      "ending: crlf, setup: [CONF CURR], query: 'FETCH?', parse: {field: 2, separator: ';'}, mode: {query: 'MODE?', "
      "answer: CURR DC}, signal: i_a, unit: mA, offset: 1, range: 2000, resolution: 0.1, period: 0.03, timeout: 0.25";
  std::atomic<Mood> mood = Mood::well;
  PortName name;
  std::unique_ptr<PseudoTerminal> line;
  std::unique_ptr<AtTheOtherEnd> other_end;
  std::unique_ptr<InputDevice> meter;

 private:
  std::mutex mutex_;
  std::vector<std::string> commands_;
  std::string pending_;
};

TEST_F(UnknownMeter, IsSetUpAskedAndReadAsTheBenchFileSays) {
  connect();
  DeviceLog log(*meter);
  EXPECT_TRUE(log.comes_reading(0.531));
  EXPECT_TRUE(was_told("CONF CURR"));
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 5; }));
  EXPECT_TRUE(log.faults.empty());
  const Channel& channel = meter->channels()[0];
  EXPECT_EQ(channel.source, "meter (SCPI, FETCH?)");
  EXPECT_NEAR(channel.lsb, 1e-4, 1e-12);
  EXPECT_NEAR(channel.high, 2.001, 1e-9);
  EXPECT_DOUBLE_EQ(channel.window, 0.03);
  EXPECT_DOUBLE_EQ(channel.conversion.file_unit, 1e-3);
}

TEST_F(UnknownMeter, APatternFindsTheNumberAsWell) {
  keys = "ending: crlf, query: 'FETCH?', parse: {regex: '([-+0-9.E]+);mA$'}, signal: i_a, unit: mA, period: 0.03";
  connect();
  EXPECT_TRUE(DeviceLog(*meter).comes_reading(0.530));
}

TEST_F(UnknownMeter, ALateAnswerIsNoReading) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.531));
  mood = Mood::late;
  std::this_thread::sleep_for(std::chrono::milliseconds(1500));
  mood = Mood::well;
  std::this_thread::sleep_for(std::chrono::milliseconds(600));
  const std::size_t before = log.readings.size();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() > before + 3; }));
  for (const Reading& reading : log.readings)
    EXPECT_DOUBLE_EQ(reading.value, 0.531) << "0.778 was asked for long before";
}

TEST_F(UnknownMeter, SilenceGivesNoReadingAndIsOvercome) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.531));
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

TEST_F(UnknownMeter, OverloadAndAnotherModeAreFaults) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.531));
  mood = Mood::overloaded;
  EXPECT_TRUE(log.comes_fault(Fault::over_range));
  mood = Mood::turned;
  EXPECT_TRUE(log.comes_fault(Fault::wrong_function));
  mood = Mood::well;
  EXPECT_TRUE(log.comes_reading(0.531));
}

TEST_F(UnknownMeter, GarbageIsNeverAReading) {
  keys =
      "ending: crlf, query: 'FETCH?', parse: {field: 2, separator: ';'}, signal: i_a, unit: mA, period: 0.03, "
      "timeout: 0.25";
  mood = Mood::mumbling;
  connect();
  DeviceLog log(*meter);
  log.look_for(0.5);
  mood = Mood::well;
  EXPECT_TRUE(log.comes_reading(0.530));
  for (const Reading& reading : log.readings) EXPECT_DOUBLE_EQ(reading.value, 0.530);
}

TEST_F(UnknownMeter, APulledAdapterIsAFaultAndTheMeterIsSetUpAgain) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.531));
  other_end->leave();
  line->hang_up();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  connect();
  EXPECT_TRUE(log.comes_reading(0.531));
}

TEST(ScpiMeter, ComplainsOfWhatCannotBe) {
  const auto with = [](const std::string& device) -> std::string {
    try {
      read_settings(bench_of(device).devices[0].yaml);
    } catch (const ConfigError& e) {
      return e.what();
    }
    return "none";
  };
  const std::string usual = "port: /dev/null, signal: i_a, query: 'READ?'";
  EXPECT_EQ(with(usual), "none");
  EXPECT_THAT(with("port: /dev/null, signal: i_a"), HasSubstr("b.yaml:4: devices.meter.query is missing"));
  EXPECT_THAT(with("port: /dev/null, query: 'READ?'"), HasSubstr("devices.meter.signal is missing"));
  EXPECT_THAT(with("port: /dev/null, signal: u_ref, query: 'READ?'"),
              HasSubstr("signal is `u_ref`. A device may give"));
  EXPECT_THAT(with(usual + ", unit: V"), HasSubstr("unit is `V`. Known: A"));
  EXPECT_THAT(with(usual + ", ending: nul"), HasSubstr("ending is `nul`. Known: lf, cr, crlf"));
  EXPECT_THAT(with(usual + ", parse: {regex: '(['}"), HasSubstr("parse.regex cannot be read: "));
  EXPECT_THAT(with(usual + ", parse: {regex: '1', field: 1}"), HasSubstr("parse.regex stands for itself"));
  EXPECT_THAT(with(usual + ", parse: {separator: ', '}"), HasSubstr("separator must be one character"));
  EXPECT_THAT(with(usual + ", mode: {query: 'FUNC?'}"), HasSubstr("mode.answer is missing"));
  EXPECT_THAT(with("port: /dev/null, signal: i_a, query: \"READ?\\n\""), HasSubstr("1 to 200 characters of ASCII"));
  EXPECT_THAT(with(usual + ", gain: 2"), HasSubstr("gain is not known here"));
}

}  // namespace
}  // namespace emtb::scpi_meter
