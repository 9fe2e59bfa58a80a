#include "drivers/serial_meter/meter.h"

#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <mutex>
#include <set>
#include <thread>

#include "drivers/registry.h"
#include "drivers/serial_meter/open.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/drivers/serial_meter/frames.h"
#include "tests/process.h"
#include "tests/temporary_file.h"

namespace emtb::serial_meter {
namespace {

using ::testing::HasSubstr;

BenchConfig bench_of(const std::string& device) {
  const TemporaryFile file(
      ".yaml", "name: b\nreference: {device: meter, min: 0, max: 6, safe: 0}\ndevices:\n  meter: {" + device + "}\n");
  return read_bench(file.path());
}

std::unique_ptr<InputDevice> opened(const std::string& device) {
  const BenchConfig bench = bench_of(device);
  return open_meter({.bench = bench,
                     .device = bench.devices[0],
                     .clock = std::make_shared<MonotonicClock>(),
                     .world = nullptr})
      .input;
}

/// What the bench file is told is wrong with the device, without the file's name.
std::string complaint_about(const std::string& device) {
  try {
    const BenchConfig bench = bench_of(device);
    read_settings(bench.devices[0].yaml);
  } catch (const ConfigError& e) {
    const std::string line = e.what();
    return line.substr(line.find(".yaml:") + 6);
  }
  return "";
}

// ---- A meter that talks by itself

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

// ---- A meter that is asked

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

// ---- Prompts, and one byte

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

TEST(SegmentsOnALine, AreRead) {
  PseudoTerminal line;
  AtTheOtherEnd fs9721([&] {
    line.write(fs9721_frame("0.530", 0b0111, 0, 0, 0, 0b1000));
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  const auto meter = opened("driver: serial_meter, port: " + line.path() + ", model: uni_t_ut60e, period: 0.02");
  EXPECT_TRUE(DeviceLog(*meter).comes_reading(0.530));
}

// ---- What a bench file may say

TEST(SerialMeterFile, EachMistakeHasItsLine) {
  const std::string good = "driver: serial_meter, port: /dev/ttyS9, model: uni_t_ut61e";
  EXPECT_EQ(complaint_about(good), "");
  EXPECT_THAT(complaint_about("driver: serial_meter, port: /dev/ttyS9, model: ut61e"),
              HasSubstr("4: devices.meter.model is `ut61e`. Known: agilent_34401a, keithley_2000, fluke_45"));
  EXPECT_EQ(complaint_about("driver: serial_meter, model: uni_t_ut61e"), "4: devices.meter.port is missing");
  EXPECT_EQ(complaint_about(good + ", signal: u_ref"),
            "4: devices.meter.signal is `u_ref`. A meter may measure e_a, i_a, omega, theta, torque, i_f, temperature");
  EXPECT_THAT(
      complaint_about(good + ", signal: omega"),
      HasSubstr("4: devices.meter.function is missing: what does the meter measure of omega? Known: dc_current"));
  EXPECT_EQ(complaint_about(good + ", signal: omega, function: dc_voltage"),
            "4: devices.meter.scale is missing: how many rad/s of omega is one V?");
  EXPECT_EQ(complaint_about(good + ", range: 20"), "4: devices.meter.range is 20 A, but the UNI-T UT61E goes to 10");
  EXPECT_EQ(complaint_about(good + ", line: 19200 9N1"),
            "4: devices.meter.line is `19200 9N1`. Write baud, bits, parity, stop bits: 9600 8N1");
  EXPECT_EQ(complaint_about(good + ", window: 2"), "4: devices.meter.window is 2, but must be 0 to 0.5");
  EXPECT_EQ(complaint_about("driver: serial_meter, port: x, model: fluke_45, function: temperature, scale: 1"),
            "4: devices.meter.function is `temperature`, which the Fluke 45 does not have");
  EXPECT_THAT(complaint_about(good + ", prot: 3"),
              HasSubstr("4: devices.meter.prot is not known here. Known: driver, port"));
}

TEST(SerialMeterFile, ALineIsWrittenAsPeopleDo) {
  const auto line = read_line("1200 7E2", {.rts = false});
  ASSERT_TRUE(line);
  EXPECT_EQ(line->baud, 1200);
  EXPECT_EQ(line->data_bits, 7);
  EXPECT_EQ(line->parity, Parity::even);
  EXPECT_EQ(line->stop_bits, 2);
  EXPECT_FALSE(line->rts);
  EXPECT_DOUBLE_EQ(line->wire_time(14), 14 * 11 / 1200.0);
  for (const char* text : {"", "9600", "9600 8N", "9600 8X1", "1234 8N1", "9600  8N1", "9600 8N3", "x600 8N1"}) {
    EXPECT_FALSE(read_line(text, {})) << text;
  }
}

TEST(SerialMeterFile, APortThatIsNotThereIsSaid) {
  const auto why = [](const std::string& port) -> std::string {
    try {
      opened("driver: serial_meter, model: uni_t_ut61e, port: " + port);
    } catch (const DeviceError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(why("/dev/no_such_port"),
            "/dev/no_such_port: No such file or directory. Plug its adapter in, or see /dev/serial/by-id for "
            "its name");
  EXPECT_THAT(why("/dev/null"), HasSubstr("/dev/null: is not a serial port"));
}

TEST(SerialMeterFile, TheShippedExampleIsInOrder) {
  const BenchConfig bench = read_bench(EMTB_SOURCE_DIR "/config/benches/fh2-metex.yaml");
  const auto meter = std::ranges::find(bench.devices, "serial_meter", &BenchConfig::Device::driver);
  ASSERT_NE(meter, bench.devices.end());
  const MeterSettings settings = read_settings(meter->yaml);
  EXPECT_EQ(settings.model->name, "metex_m4650cr");
  EXPECT_EQ(settings.signal, Signal::i_a);
  EXPECT_EQ(settings.digit, 1e-3);
}

TEST(Models, AreEightAndMoreAndMakeSense) {
  EXPECT_GE(models().size(), 8U);
  std::set<std::string_view> names;
  for (const Model& model : models()) {
    EXPECT_TRUE(names.insert(model.name).second) << model.name;
    EXPECT_EQ(model_named(model.name), &model);
    EXPECT_GT(model.period, 0);
    EXPECT_LE(model.window, model.period) << model.name;
    EXPECT_TRUE(read_line(std::to_string(model.line.baud) + " 8N1", {})) << model.name;
    for (const Range& range : model.ranges) EXPECT_LE(range.digit, range.full_scale / 900) << model.name;
    EXPECT_LT(model.line.wire_time(14), model.period) << model.name;
  }
  EXPECT_EQ(model_named("abacus"), nullptr);
}

}  // namespace
}  // namespace emtb::serial_meter
