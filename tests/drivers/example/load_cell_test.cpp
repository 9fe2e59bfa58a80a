#include "tests/drivers/example/load_cell.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <fstream>
#include <iterator>

#include "tests/drivers/device_log.h"
#include "tests/drivers/pseudo_terminal.h"

namespace emtb::load_cell {
namespace {

using ::testing::HasSubstr;

std::string whole(const std::string& path) {
  std::ifstream file(std::string(EMTB_SOURCE_DIR) + path);
  return {std::istreambuf_iterator<char>(file), {}};
}

BenchConfig with_cell(const std::string& port, const std::string& more = "") {
  return parse_bench(
      "name: b\nreference: {device: cell, min: 0, max: 6, safe: 0}\n"
      "devices:\n  cell: {driver: load_cell, lever: 0.2, port: " +
          port + more + "}\n",
      "b.yaml");
}

std::unique_ptr<InputDevice> opened(const BenchConfig& bench) {
  return open({.bench = bench, .device = bench.devices[0], .clock = std::make_shared<MonotonicClock>(), .world = {}})
      .input;
}

TEST(NewDriver, ReadsItsDeviceAndLeavesOutWhatIsNoNumber) {
  const PseudoTerminal line;
  const auto cell = opened(with_cell(line.path()));
  DeviceLog log(*cell);
  log.begin();
  line.write("5.00\r\n10.00\r\nnan\r\n" + std::string(200, '1') + "x\r\n-2.5\r\n");
  ASSERT_TRUE(log.comes_reading(-0.5));
  ASSERT_EQ(log.readings.size(), 2U);
  EXPECT_DOUBLE_EQ(log.readings[0].value, 2) << "10 N on 0.2 m";
  EXPECT_EQ(log.readings[0].sequence, 0U);
}

TEST(NewDriver, SaysThatItsDeviceHasGoneAndFindsItAgain) {
  const PortName name;
  auto line = std::make_unique<PseudoTerminal>();
  name.stand_for(line->path());
  const auto cell = opened(with_cell(name.path()));
  DeviceLog log(*cell);
  log.begin();
  line.reset();
  ASSERT_TRUE(log.comes_fault(Fault::device_lost));
  line = std::make_unique<PseudoTerminal>();
  name.stand_for(line->path());
  EXPECT_TRUE(log.comes([&] {
    line->write("1\n2\n");
    return !log.readings.empty() && log.fault == Fault::none;
  }));
}

TEST(NewDriver, ComplainsOfKeysThatItDoesNotKnow) {
  try {
    opened(with_cell("/dev/null", ", gain: 2"));
    FAIL();
  } catch (const ConfigError& e) {
    EXPECT_THAT(e.what(), HasSubstr("b.yaml:4: devices.cell.gain is not known here. Known: driver, port, lever"));
  }
}

TEST(NewDriver, IsTheOneThatThePageShowsAndShort) {
  const std::string driver = whole("/tests/drivers/example/load_cell.h");
  ASSERT_FALSE(driver.empty());
  EXPECT_LT(std::ranges::count(driver, '\n'), 100);
  EXPECT_THAT(whole("/docs/new-driver.md"), HasSubstr("```cpp\n" + driver + "```\n"));
}

}  // namespace
}  // namespace emtb::load_cell
