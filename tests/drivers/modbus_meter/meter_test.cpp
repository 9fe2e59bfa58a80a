#include "drivers/modbus_meter/meter.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <fstream>

#include "drivers/modbus_meter/open.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/process.h"
#include "tests/temporary_file.h"

namespace emtb::modbus_meter {
namespace {

using ::testing::HasSubstr;

// ---- Registers to numbers

TEST(ModbusValue, LiesInOneRegisterOrTwo) {
  const Order order = *order_named("ABCD");
  EXPECT_EQ(decode(std::array<std::uint16_t, 1>{0xfffe}, Type::u16, order), 65534);
  EXPECT_EQ(decode(std::array<std::uint16_t, 1>{0xfffe}, Type::s16, order), -2);
  EXPECT_EQ(decode(std::array<std::uint16_t, 2>{0x0001, 0x0002}, Type::u32, order), 65538);
  EXPECT_EQ(decode(std::array<std::uint16_t, 2>{0xffff, 0xfffe}, Type::s32, order), -2);
  EXPECT_EQ(decode(std::array<std::uint16_t, 2>{0xffff, 0xfffe}, Type::u32, order), 4294967294.0);
  EXPECT_EQ(decode(std::array<std::uint16_t, 2>{0xc2dc, 0x8000}, Type::f32, order), -110.25);
  EXPECT_EQ(words_of(Type::s16), 1);
  EXPECT_EQ(words_of(Type::f32), 2);
}

TEST(ModbusValue, ComesInAnyOrderOfItsBytes) {
  using Words = std::array<std::uint16_t, 2>;
  EXPECT_EQ(decode(Words{0x1122, 0x3344}, Type::u32, *order_named("ABCD")), 0x11223344);
  EXPECT_EQ(decode(Words{0x3344, 0x1122}, Type::u32, *order_named("CDAB")), 0x11223344);
  EXPECT_EQ(decode(Words{0x2211, 0x4433}, Type::u32, *order_named("BADC")), 0x11223344);
  EXPECT_EQ(decode(Words{0x4433, 0x2211}, Type::u32, *order_named("DCBA")), 0x11223344);
  EXPECT_EQ(decode(std::array<std::uint16_t, 1>{0x2211}, Type::u16, *order_named("BADC")), 0x1122);
  EXPECT_EQ(decode(std::array<std::uint16_t, 1>{0x1122}, Type::u16, *order_named("CDAB")), 0x1122);
  EXPECT_FALSE(order_named("ACBD"));
  EXPECT_FALSE(type_named("f64"));
}

// ---- The meter, against pymodbus

BenchConfig modbus_bench(const std::string& device) {
  const TemporaryFile file(
      ".yaml",
      "name: b\nreference: {device: meter, min: 0, max: 6, safe: 0}\ndevices:\n  meter:\n    " + device + "\n");
  return read_bench(file.path());
}

std::unique_ptr<InputDevice> opened_modbus(const std::string& device) {
  const BenchConfig bench = modbus_bench(device);
  return open_meter({.bench = bench,
                     .device = bench.devices[0],
                     .clock = std::make_shared<MonotonicClock>(),
                     .world = nullptr})
      .input;
}

const std::string current = "i_a: {address: 0, type: s16, unit: mA, overload: 32767, window: 0.02}";

/// A port of loopback that nobody listens at.
int free_tcp_port() {
  const int file = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  auto* generic = reinterpret_cast<sockaddr*>(&address);
  EXPECT_EQ(bind(file, generic, size), 0);
  EXPECT_EQ(getsockname(file, generic, &size), 0);
  close(file);
  return ntohs(address.sin_port);
}

class ModbusTest : public ::testing::Test {
 protected:
  void answer(const std::string& mood) const {
    const std::string path = mood_.path();
    std::ofstream(path + ".new") << mood;
    std::filesystem::rename(path + ".new", path);  // the server never reads half a word
  }
  void serve(const std::string& kind, const std::string& where) {
    server_ = std::make_unique<Process>(
        std::vector<std::string>{"/usr/bin/python3", EMTB_SOURCE_DIR "/tests/drivers/modbus_meter/server.py",
                                 mood_.path().string(), kind, where},
        mood_.path().string());
  }
  /// The device, as soon as the server is there.
  void open(const std::string& address, const std::string& registers = current, const std::string& more = "") {
    const std::string text = "{driver: modbus_meter, " + address + ", unit: 7, period: 0.02, timeout: 0.15" + more +
                             ", registers: {" + registers + "}}";
    std::string why;
    eventually(
        [&] {
          try {
            meter = opened_modbus(text);
          } catch (const DeviceError& e) {
            why = e.what();
          }
          return meter != nullptr;
        },
        30);
    ASSERT_TRUE(meter) << why << server_->err();
  }
  void end_server() { server_.reset(); }
  void TearDown() override {
    meter.reset();
    server_.reset();
    for (const char* rest : {".out", ".err"}) std::filesystem::remove(mood_.path().string() + rest);
  }

  std::unique_ptr<InputDevice> meter;

 private:
  TemporaryFile mood_{".mood", "well"};
  std::unique_ptr<Process> server_;
};

class ModbusTcp : public ModbusTest {
 protected:
  void connect(const std::string& registers = current, const std::string& more = "") {
    serve("tcp", std::to_string(port));
    open(address(), registers, more);
  }
  std::string address() const { return "tcp: 127.0.0.1:" + std::to_string(port); }
  const int port = free_tcp_port();
};

/// Two pseudo-terminals and who carries the bytes from one to the other: a line with the meter at its end.
class ModbusRtu : public ModbusTest {
 protected:
  void wire() {
    ours = std::make_unique<PseudoTerminal>();
    theirs = std::make_unique<PseudoTerminal>();
    name.stand_for(ours->path());
    wires = std::make_unique<AtTheOtherEnd>([this] {
      theirs->write(ours->read(0.001));
      ours->write(theirs->read(0.001));
    });
    serve("rtu", theirs->path());
  }
  void connect(const std::string& registers = current) {
    wire();
    open("port: " + name.path() + ", line: 19200 8N1", registers);
  }
  void TearDown() override {
    ModbusTest::TearDown();
    wires.reset();
  }
  PortName name;
  std::unique_ptr<PseudoTerminal> ours, theirs;
  std::unique_ptr<AtTheOtherEnd> wires;
};

TEST_F(ModbusTcp, ReadsEveryTypeAtItsPlaceInSi) {
  connect(current +
          ", e_a: {address: 2, type: f32, resolution: 0.01}"
          ", omega: {address: 4, type: s32, order: CDAB, unit: rpm, scale: 0.1}"
          ", temperature: {address: 0, function: 3, type: u16, scale: 0.1}");
  const auto channels = meter->channels();
  ASSERT_EQ(channels.size(), 4U);
  EXPECT_EQ(channels[0].signal, Signal::i_a);
  EXPECT_DOUBLE_EQ(channels[0].lsb, 1e-3);
  EXPECT_EQ(channels[0].window, 0.02);
  EXPECT_EQ(channels[0].period, 0.02);
  EXPECT_EQ(channels[1].lsb, 0.01);
  EXPECT_THAT(channels[2].source, HasSubstr("unit 7, function 4, register 4"));
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 12; }));
  std::map<Signal, double> last;
  for (const Reading& reading : log.readings) last[reading.signal] = reading.value;
  EXPECT_DOUBLE_EQ(last[Signal::i_a], 0.530);
  EXPECT_DOUBLE_EQ(last[Signal::e_a], 110.25);
  EXPECT_NEAR(last[Signal::omega], -1508.0 * 2 * M_PI / 60, 1e-9);
  EXPECT_DOUBLE_EQ(last[Signal::temperature], 23.5);
  EXPECT_TRUE(log.faults.empty());
}

TEST_F(ModbusTcp, ReadingsHaveTimeAndNumber) {
  connect(current, ", latency: 0.5");
  DeviceLog log(*meter);
  const MonotonicClock clock;
  log.begin();
  const double before = clock.now();
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 10; }));
  const double after = clock.now();
  EXPECT_LE(log.readings[0].sequence, 1U);
  for (std::size_t k = 1; k < log.readings.size(); ++k) {
    EXPECT_GE(log.readings[k].time, before - 0.5);
    EXPECT_LE(log.readings[k].time, after - 0.5);
    EXPECT_GT(log.readings[k].time, log.readings[k - 1].time);
    EXPECT_GT(log.readings[k].sequence, log.readings[k - 1].sequence);
  }
}

TEST_F(ModbusTcp, SilenceAndLateAnswersGiveNoReading) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  for (const char* mood : {"silent", "late 0.25"}) {
    answer(mood);
    log.look_for(0.3);
    const std::size_t before = log.readings.size();
    log.look_for(0.7);
    EXPECT_EQ(log.readings.size(), before) << mood;
    answer("fast");
    EXPECT_TRUE(log.comes_reading(0.810)) << mood;
  }
  for (const Reading& reading : log.readings) EXPECT_NE(reading.value, 0.777) << "answers to questions long past";
}

TEST_F(ModbusTcp, AnAnswerToAnotherQuestionIsNoReading) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  answer("garbled");
  log.look_for(0.2);
  const std::size_t before = log.readings.size();
  log.look_for(0.3);
  EXPECT_EQ(log.readings.size(), before);
  answer("fast");
  EXPECT_TRUE(log.comes_reading(0.810));
}

TEST_F(ModbusTcp, OverloadAndNanAreFaults) {
  connect(current + ", e_a: {address: 2, type: f32}");
  DeviceLog log(*meter);
  answer("overload");
  EXPECT_TRUE(log.comes_fault(Fault::over_range));
  log.look();
  EXPECT_EQ(log.fault, Fault::over_range) << "it stands, though the voltage is well";
  answer("nan");
  EXPECT_TRUE(log.comes_fault(Fault::non_finite));
  answer("well");
  EXPECT_TRUE(log.comes([&] { return log.fault == Fault::none; }));
  for (const Reading& reading : log.readings) EXPECT_TRUE(reading.value == 0.530 || reading.value == 110.25);
}

TEST_F(ModbusTcp, ABusyMeterIsAskedAgain) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  answer("busy");
  log.look_for(0.2);
  const std::size_t before = log.readings.size();
  log.look_for(0.2);
  EXPECT_EQ(log.readings.size(), before);
  answer("fast");
  EXPECT_TRUE(log.comes_reading(0.810));
}

TEST_F(ModbusTcp, AHostThatGoesIsAFaultAndComesBack) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  end_server();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  log.look();
  EXPECT_EQ(log.fault, Fault::device_lost) << "it stands";
  answer("fast");
  serve("tcp", std::to_string(port));
  EXPECT_TRUE(log.comes_reading(0.810));
}

TEST_F(ModbusTcp, WhatIsNotThereIsSaidAtOnce) {
  const auto why = [&](const std::string& device) -> std::string {
    try {
      opened_modbus("{driver: modbus_meter, timeout: 0.1, " + device + "}");
    } catch (const DeviceError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(why(address() + ", registers: {" + current + "}"),
              HasSubstr(std::to_string(port) + ": Connection refused"));
  connect();
  EXPECT_THAT(
      why(address() + ", unit: 7, registers: {e_a: {address: 100, type: f32}}"),
      HasSubstr("unit 7, e_a at register 100 (function 4): Illegal data address. See the meter's list of registers"));
  EXPECT_THAT(why("port: /dev/no_such_port, registers: {" + current + "}"),
              HasSubstr("/dev/no_such_port: No such file or directory"));
}

TEST_F(ModbusRtu, ReadsOverASerialLine) {
  connect(current + ", e_a: {address: 2, type: f32}");
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes([&] { return log.readings.size() >= 6; }));
  for (const Reading& reading : log.readings) {
    EXPECT_DOUBLE_EQ(reading.value, reading.signal == Signal::i_a ? 0.530 : 110.25);
  }
  EXPECT_TRUE(log.faults.empty());
}

TEST_F(ModbusRtu, AWrongChecksumIsNoReading) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  answer("garbled");
  log.look_for(0.1);
  const std::size_t before = log.readings.size();
  log.look_for(0.8);
  EXPECT_EQ(log.readings.size(), before);
  answer("fast");
  EXPECT_TRUE(log.comes_reading(0.810));
}

TEST_F(ModbusRtu, ALateAnswerIsNotTakenForTheNext) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  answer("late 0.35");  // two timeouts
  log.look_for(2.5);
  answer("fast");
  ASSERT_TRUE(log.comes_reading(0.810));
  for (const Reading& reading : log.readings) EXPECT_NE(reading.value, 0.777) << "answers to questions long past";
}

TEST_F(ModbusRtu, SilenceGivesNoReading) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  answer("silent");
  log.look_for(0.1);
  const std::size_t before = log.readings.size();
  log.look_for(0.5);
  EXPECT_EQ(log.readings.size(), before);
  answer("fast");
  EXPECT_TRUE(log.comes_reading(0.810));
}

TEST_F(ModbusRtu, APulledAdapterIsAFaultAndComesBack) {
  connect();
  DeviceLog log(*meter);
  ASSERT_TRUE(log.comes_reading(0.530));
  wires->leave();
  ours->hang_up();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  end_server();
  answer("fast");
  wire();
  EXPECT_TRUE(log.comes_reading(0.810));
}

// ---- What a bench file may say

std::string modbus_complaint(const std::string& device) {
  try {
    const BenchConfig bench = modbus_bench(device);
    read_settings(bench.devices[0].yaml);
  } catch (const ConfigError& e) {
    const std::string line = e.what();
    return line.substr(line.find(".yaml:") + 6);
  }
  return "";
}

TEST(ModbusMeterFile, EachMistakeHasItsLine) {
  const auto with = [](const std::string& registers, const std::string& where = "tcp: 10.0.0.7") {
    return modbus_complaint("{driver: modbus_meter, " + where + ", registers: {" + registers + "}}");
  };
  EXPECT_EQ(with(current), "");
  EXPECT_EQ(with(current, "tcp: 10.0.0.7:x"),
            "5: devices.meter.tcp is `10.0.0.7:x`. Write HOST or HOST:PORT, 192.168.1.20:502");
  EXPECT_EQ(with(current, "tcp: 10.0.0.7, line: 9600 8N1"),
            "5: devices.meter.line is for a serial line, but the meter is on tcp. Remove it");
  EXPECT_EQ(with(current, "unit: 1"),
            "5: devices.meter.tcp or port: give one of them, tcp: HOST:PORT or port: /dev/...");
  EXPECT_EQ(with(current, "port: /dev/ttyS0, line: fast"),
            "5: devices.meter.line is `fast`. Write baud, bits, parity, stop bits: 9600 8N1");
  EXPECT_EQ(with(current, "tcp: h, unit: 300"), "5: devices.meter.unit is 300, but must be 0 to 255");
  EXPECT_EQ(with(""), "5: devices.meter.registers is empty. Give at least one signal");
  EXPECT_EQ(with("u_ref: {address: 0, type: u16}"),
            "5: devices.meter.registers.u_ref cannot be measured here. A device may give e_a, i_a, omega, theta, "
            "torque, i_f, "
            "temperature");
  EXPECT_EQ(with("i_a: {type: u16}"), "5: devices.meter.registers.i_a.address is missing");
  EXPECT_EQ(with("i_a: {address: 1.5, type: u16}"), "5: devices.meter.registers.i_a.address must be a whole number");
  EXPECT_EQ(with("i_a: {address: 1, type: f64}"),
            "5: devices.meter.registers.i_a.type is `f64`. Known: u16, s16, u32, s32, f32");
  EXPECT_EQ(with("i_a: {address: 1, type: f32, order: BACD}"),
            "5: devices.meter.registers.i_a.order is `BACD`. Known: ABCD, CDAB, BADC, DCBA");
  EXPECT_THAT(with("i_a: {address: 1, type: f32, unit: V}"),
              HasSubstr("5: devices.meter.registers.i_a.unit is `V`. Known: A"));
  EXPECT_EQ(with("i_a: {address: 1, type: f32, function: 5}"),
            "5: devices.meter.registers.i_a.function is 5, but must be 3 to 4");
}

TEST(ModbusMeterFile, TheShippedExampleIsInOrder) {
  const BenchConfig bench = read_bench(EMTB_SOURCE_DIR "/config/benches/fh2-modbus.yaml");
  const auto meter = std::ranges::find(bench.devices, "modbus_meter", &BenchConfig::Device::driver);
  ASSERT_NE(meter, bench.devices.end());
  const MeterSettings settings = read_settings(meter->yaml);
  ASSERT_EQ(settings.registers.size(), 2U);
  EXPECT_EQ(settings.registers[0].signal, Signal::i_a);
  EXPECT_DOUBLE_EQ(settings.registers[0].scaling.scale, 1e-3);
  EXPECT_EQ(settings.registers[1].type, Type::f32);
}

TEST(ModbusMeterFile, UnitScaleAndOffsetComeToSi) {
  const BenchConfig bench = modbus_bench(
      "{driver: modbus_meter, tcp: meter.lab, registers: {i_a: {address: 1, type: s16, unit: mA, scale: 10, offset: "
      "5}}}");
  const MeterSettings settings = read_settings(bench.devices[0].yaml);
  ASSERT_EQ(settings.registers.size(), 1U);
  EXPECT_DOUBLE_EQ(settings.registers[0].scaling.scale, 0.01);
  EXPECT_DOUBLE_EQ(settings.registers[0].scaling.offset, 0.005);
  EXPECT_DOUBLE_EQ(settings.registers[0].scaling.digit, 0.01);
  EXPECT_EQ(name_of(settings.address), "meter.lab:502");
}

}  // namespace
}  // namespace emtb::modbus_meter
