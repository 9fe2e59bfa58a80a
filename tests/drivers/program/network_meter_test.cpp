#include <gmock/gmock.h>

#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/opened_bench.h"
#include "tests/drivers/program/python_device.h"
#include "tests/process.h"

namespace emtb::program {
namespace {

using testing::HasSubstr;

/// The shipped example at a meter of the test's own on loopback.
class NetworkMeter : public PythonFolder {
 protected:
  NetworkMeter() {
    meter = std::make_unique<Process>(
        std::vector<std::string>{
            "/usr/bin/python3", "-c",
            "import os, socket, sys\n"
            "server = socket.create_server(('127.0.0.1', 0))\n"
            "print(server.getsockname()[1], flush=True)\n"
            "while True:\n"
            "  line = server.accept()[0].makefile('rw')\n"
            "  for question in line:\n"
            "    mood = open(sys.argv[1]).read()\n"
            "    if mood == 'gone': break\n"
            "    line.write({'*IDN?': 'TEST,METER,1,2', 'MEAS:CURR?': mood}[question.strip()] + '\\n')\n"
            "    line.flush()\n"
            "  line.close()\n",
            write("mood", "+5.30E-01").string()},
        path("meter"));
    eventually([&] { return meter->out().ends_with("\n"); });
    address = "127.0.0.1:" + meter->out();
    address.pop_back();
  }
  std::unique_ptr<InputDevice> open(const std::string& where) {
    const std::string words = shipped("scpi_over_tcp.py") + ", \"" + where + "\", i_a, \"MEAS:CURR?\", \"0.02\"";
    BenchInputs inputs = open_inputs(read_bench(
        write("bench.yaml",
              "name: b\nreference: {device: card, min: 0, max: 6, safe: 0}\nsimulation: {motor: {R_a: 1, K_b: "
              "1, K_m: 1, J: 1}}\ndevices:\n  card: {driver: simulated_daq, channels: {omega: {range: [-1, "
              "1]}}}\n  meter: {driver: program, command: [python3, " +
                  words + "]" + its_user() + ", channels: {i_a: {period: 0.02, window: 0.02}}}\n")));
    why_not = inputs.devices[1].why_not;
    return std::move(inputs.devices[1].input);
  }
  std::unique_ptr<Process> meter;
  std::string address, why_not;
};

TEST_F(NetworkMeter, IsReadByTheExample) {
  const auto input = open(address);
  ASSERT_TRUE(input) << why_not;
  DeviceLog log(*input);
  EXPECT_TRUE(log.comes_reading(0.53));
  EXPECT_TRUE(log.comes([&] { return log.readings.size() >= 5; }));
  write("mood", "+9.90E+37");
  EXPECT_TRUE(log.comes_fault(Fault::over_range));
  write("mood", "gone");
  EXPECT_TRUE(log.comes_fault(Fault::device_lost));
  write("mood", "-1.0");
  EXPECT_TRUE(log.comes_reading(-1));
}

TEST_F(NetworkMeter, ThatIsNotThereIsSaidInOneLine) {
  meter.reset();
  EXPECT_FALSE(open(address));
  EXPECT_THAT(why_not, HasSubstr("meter: /usr/bin/python3: it ended with code 1: ConnectionRefusedError"));
}

}  // namespace
}  // namespace emtb::program
