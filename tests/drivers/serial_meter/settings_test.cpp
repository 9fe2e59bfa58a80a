#include <gmock/gmock.h>

#include <algorithm>
#include <set>
#include <string>
#include <string_view>

#include "drivers/serial_meter/meter.h"
#include "hal/error.h"
#include "tests/drivers/serial_meter/opened.h"

namespace emtb::serial_meter {
namespace {

using ::testing::HasSubstr;

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

TEST(SerialMeterFile, EachMistakeHasItsLine) {
  const std::string good = "driver: serial_meter, port: /dev/ttyS9, model: uni_t_ut61e";
  EXPECT_EQ(complaint_about(good), "");
  EXPECT_THAT(complaint_about("driver: serial_meter, port: /dev/ttyS9, model: ut61e"),
              HasSubstr("4: devices.meter.model is `ut61e`. Known: agilent_34401a, keithley_2000, fluke_45"));
  EXPECT_EQ(complaint_about("driver: serial_meter, model: uni_t_ut61e"), "4: devices.meter.port is missing");
  EXPECT_EQ(complaint_about(good + ", signal: u_ref"),
            "4: devices.meter.signal is `u_ref`. A device may give e_a, i_a, omega, theta, torque, i_f, temperature");
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
