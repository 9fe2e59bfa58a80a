#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <atomic>
#include <cmath>
#include <iomanip>
#include <sstream>

#include "config/yaml.h"
#include "tests/drivers/program/python_device.h"
#include "tests/drivers/pseudo_terminal.h"
#include "tests/drivers/serial_daq/desk.h"
#include "tests/drivers/serial_meter/frames.h"
#include "tests/process.h"
#include "tests/session/scratch.h"
#include "tests/tools/shipped_bench.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::Not;

/// `emtb bench check` and `calibrate` on the simulated FH2 bench with one thing about it changed, and on a board at the
/// far end of a line.
class BenchInputCommands : public Scratch {
 protected:
  std::string changed(const std::string& from = "", const std::string& to = "") const {
    return write("bench.yaml", fh2_simulated(from, to)).string();
  }
  int call(std::vector<std::string> words) {
    words.insert(words.begin(), {EMTB, "bench"});
    last = std::make_unique<Process>(words, path("emtb" + std::to_string(++called_)));
    return last->wait(60);
  }
  std::string board(const serial_daq::Desk& desk) const {
    return write("board.yaml",
                 "# mine\n"
                 "name: desk\n"
                 "reference: {device: board, full_duty: 6, min: -6, max: 6, safe: 0}\n"
                 "devices:\n"
                 "  board:\n"
                 "    driver: serial_daq\n"
                 "    port: " +
                     desk.port() +
                     "\n"
                     "    channels:\n"
                     "      torque: {from: A2, scale: 1}   # [N m] the gauge\n"
                     "      i_a: {from: A0, scale: 20, offset: -10}\n")
        .string();
  }
  std::unique_ptr<Process> last;

 private:
  int called_ = 0;
};

TEST_F(BenchInputCommands, CheckReadsEachSignalInVoltsAndInItsUnit) {
  EXPECT_EQ(
      call({"check", changed("omega: {range: [-200, 200], noise: 0.2}", "omega: {range: [-200, 200], offset: 50}")}), 0)
      << last->out() << last->err();
  EXPECT_THAT(last->out(), testing::ContainsRegex("omega +50 +0 +rad/s +2.5 V +-200 to 199.9"));
  EXPECT_THAT(last->out(), HasSubstr("i_a: exactly 0 in all"));
  EXPECT_THAT(last->out(), Not(HasSubstr("u_ref: exactly 0"))) << "it is set so";
  EXPECT_THAT(last->out(), Not(HasSubstr("WRONG")));
}

TEST_F(BenchInputCommands, CheckSaysWhatIsWrong) {
  EXPECT_EQ(call({"check", changed("torque: {range: [-2, 2], noise: 0.002}", "torque: {range: [-2, 2], offset: 5}")}),
            1);
  EXPECT_THAT(last->out(), HasSubstr("WRONG: torque: at the upper rail"));
  EXPECT_THAT(last->out(), HasSubstr("WRONG: torque: beyond limits.torque, 0.8 N m"));
  EXPECT_EQ(call({"check", changed("driver: simulated_meter\n    signal: i_a\n    period: 0.4",
                                   "driver: simulated_meter\n    signal: i_a\n    period: 0.4\n    latency: 100")}),
            1);
  EXPECT_THAT(last->out(), HasSubstr("WRONG: i_a: nothing came in"));
  EXPECT_EQ(
      call({"check",
            changed("driver: simulated_meter\n    signal: i_a\n    period: 0.4         # [s] 2.5 readings a second, as "
                    "bench multimeters send over RS-232\n    window: 0.4         # [s] it averages all the time "
                    "between them\n    resolution: 0.001   # [A] last digit of the 10 A range of a 4 1/2 digit meter",
                    "driver: serial_meter\n    model: metex_m4650cr\n    port: /dev/none\n    signal: i_a\n    "
                    "function: dc_current\n    range: 20")}),
      1)
      << last->err();
  EXPECT_THAT(last->out(), HasSubstr("WRONG: meter: /dev/none"));
  EXPECT_THAT(last->out(), HasSubstr("torque")) << "the others are read all the same";
  EXPECT_EQ(call({"check"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("which bench FILE?"));
}

TEST_F(BenchInputCommands, CheckMovesNothing) {
  const serial_daq::Desk desk;
  EXPECT_EQ(call({"check", board(desk)}), 0) << last->out();
  EXPECT_THAT(last->out(), HasSubstr("note: torque: at 0, the least that its input can tell"));
  EXPECT_EQ(desk.duty(), 0);
  EXPECT_EQ(desk.omega(), 0);
}

TEST_F(BenchInputCommands, CalibrateFitsWhatIsTypedAndWritesIt) {
  serial_daq::Desk desk;
  const std::string file = board(desk);
  chmod(file.c_str(), 0640);
  const std::string typed = path("typed").string();
  ASSERT_EQ(mkfifo(typed.c_str(), 0600), 0);
  Process emtb(
      {"/bin/sh", "-c",
       std::string("exec ") + EMTB + " bench calibrate " + file + " torque --seconds 0.3 --arm 0.1 < " + typed},
      path("calibrate"));
  {
    std::ofstream keyboard(typed);
    const auto prompted = [&](const std::string& prompt) {
      return eventually([&] { return emtb.out().find(prompt) != std::string::npos; });
    };
    // 1023 codes are 4 N m, less 1 N m: 0 N m at 256, 0.980665 at 506.6, 2 at 767.
    ASSERT_TRUE(prompted("1> ")) << emtb.err();
    desk.set_a2(256);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    keyboard << "0" << std::endl;
    ASSERT_TRUE(prompted("2> ")) << emtb.out();
    desk.set_a2(507);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    keyboard << "one" << std::endl << "1 kg" << std::endl;
    ASSERT_TRUE(prompted("3> ")) << emtb.out();
    desk.set_a2(767);
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    keyboard << "2" << std::endl << std::endl;
  }
  EXPECT_EQ(emtb.wait(), 0) << emtb.out() << emtb.err();
  EXPECT_THAT(emtb.out(), HasSubstr("not taken: `one` is no number"));
  EXPECT_THAT(emtb.out(), HasSubstr("0.980665 N m at 0.4956"));
  EXPECT_THAT(emtb.out(), HasSubstr("factor of 4"));
  const std::string text = read(file);
  EXPECT_THAT(text, testing::ContainsRegex("torque: .offset: -1.00[0-9]*, from: A2, scale: 4.00[0-9]*.   # .N m. the "
                                           "gauge; calibrated 20[0-9-]+: residual 0.00[0-9]* N m, 3 points\n"));
  EXPECT_THAT(text, HasSubstr("# mine\nname: desk\n"));
  EXPECT_THAT(text, HasSubstr("i_a: {from: A0, scale: 20, offset: -10}\n"));
  struct stat after {};
  stat(file.c_str(), &after);
  EXPECT_EQ(after.st_mode & 0777U, 0640U);
}

TEST_F(BenchInputCommands, CalibrateIsLearntOnTheSimulatedBench) {
  // The tacho gives a tenth too little and stands at 3 rad/s at rest; its card is believed to be 20 rad/s a volt.
  const std::string file = changed("omega: {range: [-200, 200], noise: 0.2}",
                                   "omega: {range: [-200, 200], noise: 0.2, gain: 0.9, offset: 3}");
  const auto speed_at_rest = [&] {
    EXPECT_EQ(call({"check", file}), 0) << last->out() << last->err();
    const std::string out = last->out();
    const std::size_t at = out.find("\n  omega ");
    return at == std::string::npos ? std::nan("") : std::stod(out.substr(at + 9));
  };
  EXPECT_NEAR(speed_at_rest(), 3, 0.2);
  const std::string typed = write("typed", "0\n50\n100\n1500 rpm\n\n").string();
  Process emtb(
      {"/bin/sh", "-c", std::string("exec ") + EMTB + " bench calibrate " + file + " omega --seconds 0.3 < " + typed},
      path("calibrate"));
  EXPECT_EQ(emtb.wait(), 0) << emtb.out() << emtb.err();
  EXPECT_THAT(emtb.out(),
              HasSubstr("omega is daq omega (simulated): scale 20 rad/s per V, offset 0 rad/s.\nThe machine "
                        "is simulated: type a value, and it is held there."));
  const YamlMap omega = YamlMap::load(file).map("devices").map("daq").map("channels").map("omega");
  EXPECT_NEAR(omega.number("scale"), 20 / 0.9, 0.02);
  EXPECT_NEAR(omega.number("zero"), -3 / 0.9, 0.1);
  EXPECT_EQ(omega.number("offset"), 3) << "the sensor is as wrong as it was; now it is allowed for";
  EXPECT_NEAR(speed_at_rest(), 0, 0.2);
}

TEST_F(BenchInputCommands, CalibrateFitsTheShuntOfAMeter) {
  const PseudoTerminal line;
  std::atomic<double> volts = 0;
  const AtTheOtherEnd metex([&] {
    std::ostringstream shown;
    shown << std::fixed << std::setprecision(4) << volts;
    for (const char c : line.read(0.005)) {
      if (c == 'D') line.write(serial_meter::metex_frame("DC", shown.str(), "V"));
    }
  });
  const std::string file = write("meter.yaml",
                                 "name: b\n"
                                 "reference: {device: daq, min: 0, max: 6, safe: 0}\n"
                                 "devices:\n"
                                 "  daq: {driver: usb1608g, channels: {omega: {channel: 0, scale: 20}}}\n"
                                 "  meter:\n"
                                 "    driver: serial_meter\n"
                                 "    model: metex_m4650cr\n"
                                 "    port: " +
                                     line.path() +
                                     "\n"
                                     "    function: dc_voltage\n"
                                     "    scale: 10      # [A/V] a shunt of 0.1 ohm\n"
                                     "    period: 0.02\n")
                               .string();
  const std::string typed = path("typed").string();
  ASSERT_EQ(mkfifo(typed.c_str(), 0600), 0);
  Process emtb(
      {"/bin/sh", "-c", std::string("exec ") + EMTB + " bench calibrate " + file + " i_a --seconds 0.5 < " + typed},
      path("calibrate"));
  {
    std::ofstream keyboard(typed);
    int points = 0;
    for (const double amperes : {0.0, 0.5, 1.0}) {
      const std::string prompt = std::to_string(++points) + "> ";
      ASSERT_TRUE(eventually([&] { return emtb.out().find(prompt) != std::string::npos; })) << emtb.out() << emtb.err();
      volts = 0.002 + 0.096 * amperes;  // what the shunt really is
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      keyboard << amperes << std::endl;
    }
    ASSERT_TRUE(eventually([&] { return emtb.out().find("4> ") != std::string::npos; })) << emtb.out();
    keyboard << std::endl;
  }
  EXPECT_EQ(emtb.wait(), 0) << emtb.out() << emtb.err();
  const YamlMap meter = YamlMap::load(file).map("devices").map("meter");
  EXPECT_NEAR(meter.number("scale"), 1 / 0.096, 0.1);
  EXPECT_NEAR(meter.number("offset"), -0.002 / 0.096, 0.01);
  EXPECT_THAT(read(file), HasSubstr("   # calibrated 20"));
  EXPECT_THAT(read(file), HasSubstr("# [A/V] a shunt of 0.1 ohm\n")) << "what somebody wrote stays";
}

TEST_F(BenchInputCommands, CalibrateWritesInTheUnitOfAModbusRegister) {
  const PseudoTerminal ours;
  const PseudoTerminal theirs;
  const AtTheOtherEnd wires([&] {
    theirs.write(ours.read(0.001));
    ours.write(theirs.read(0.001));
  });
  const auto answer = [&](const std::string& mood) { std::filesystem::rename(write("mood.new", mood), path("mood")); };
  answer("well");
  const Process server({"/usr/bin/python3", EMTB_SOURCE_DIR "/tests/drivers/modbus_meter/server.py",
                        path("mood").string(), "rtu", theirs.path()},
                       path("server"));
  const std::string file = write("modbus.yaml",
                                 "name: b\n"
                                 "reference: {device: daq, min: 0, max: 6, safe: 0}\n"
                                 "devices:\n"
                                 "  daq: {driver: usb1608g, channels: {omega: {channel: 0, scale: 20}}}\n"
                                 "  meter:\n"
                                 "    driver: modbus_meter\n"
                                 "    port: " +
                                     ours.path() +
                                     "\n"
                                     "    line: 19200 8N1\n"
                                     "    unit: 7\n"
                                     "    period: 0.05\n"
                                     "    registers:\n"
                                     "      i_a: {address: 0, type: s16, unit: mA}\n")
                               .string();
  // The register is 530, and 810 later.
  const std::string script = "(sleep 1; echo 1.01; while [ ! -e " + path("fast").string() +
                             " ]; do sleep 0.1; done; sleep 1; echo 1.57) | " + EMTB + " bench calibrate " + file +
                             " i_a --seconds 0.5";
  int ended = -1;
  ASSERT_TRUE(eventually([&] {  // the server takes its time to come up
    std::error_code absent;
    std::filesystem::remove(path("fast"), absent);
    answer("well");
    Process emtb({"/bin/sh", "-c", script}, path("calibrate"));
    eventually([&] { return !emtb.running() || emtb.out().find("2> ") != std::string::npos; });
    answer("fast");
    write("fast", "");
    ended = emtb.wait();
    return ended == 0;
  })) << ended
      << server.err();
  const YamlMap i_a = YamlMap::load(file).map("devices").map("meter").map("registers").map("i_a");
  EXPECT_NEAR(i_a.number("scale"), 2, 1e-4) << "[mA]";
  EXPECT_NEAR(i_a.number("offset"), -50, 0.01) << "[mA]";
}

TEST_F(BenchInputCommands, CalibrateSaysOfAMeterThatHasNoScaleWhy) {
  EXPECT_EQ(call({"calibrate", changed(), "i_a"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("bench.yaml: meter i_a (simulated) has no scale and offset in the bench file: its "
                                     "readings are taken as they come"));
}

TEST_F(BenchInputCommands, CalibrateLeavesTheFileWhereTheReferencesMakeNoLine) {
  serial_daq::Desk desk;
  desk.set_a2(400);
  const std::string file = board(desk);
  const std::string before = read(file);
  const auto calibrate = [&](const std::string& typed, const std::string& signal = "torque") {
    const std::string lines = write("lines", typed).string();
    last = std::make_unique<Process>(std::vector<std::string>{"/bin/sh", "-c",
                                                              std::string("exec ") + EMTB + " bench calibrate " + file +
                                                                  " " + signal + " --seconds 0.1 < " + lines},
                                     path("calibrate"));
    return last->wait();
  };
  EXPECT_EQ(calibrate("1\n2\n"), 2);
  EXPECT_THAT(last->err(), HasSubstr("reads the same at all references")) << last->out();
  EXPECT_EQ(calibrate("1 kg\n3\n"), 2);
  EXPECT_THAT(last->out(), HasSubstr("not taken: a weight needs its lever"));
  EXPECT_THAT(last->err(), HasSubstr("two points at least"));
  EXPECT_EQ(calibrate("", "omega"), 2);
  EXPECT_THAT(last->err(), HasSubstr("no device has a channel omega, and no meter measures it"));
  EXPECT_EQ(read(file), before);
}

/// The shipped bench whose one device is a program.
class ProgramBenchCommand : public program::PythonFolder {
 protected:
  /// Whether whoever a program becomes may read a file.
  static bool open_to_all(const std::filesystem::path& file) {
    using std::filesystem::perms;
    const auto has = [](const std::filesystem::path& one, perms bit) {
      return (std::filesystem::status(one).permissions() & bit) != perms::none;
    };
    for (auto folder = file.parent_path(); folder != folder.root_path(); folder = folder.parent_path()) {
      if (!has(folder, perms::others_exec)) return false;
    }
    return has(file, perms::others_read);
  }
};

/// As somebody tries it: the shipped file, where it stands and as a bench of one's own, /etc/emtb/bench.yaml.
TEST_F(ProgramBenchCommand, TheShippedExampleRunsWhereverItIsCopied) {
  const std::filesystem::path config(EMTB_CONFIG), bench = config / "benches/desk-program.yaml";
  if (geteuid() == 0 && !open_to_all(config / "devices/toy_motor.py")) {
    GTEST_SKIP() << "root's program becomes nobody, who may not read the sources here";
  }
  for (const auto& file : {bench, write("etc/bench.yaml", read(bench))}) {
    Process check({EMTB, "bench", "check", file.string()}, path("check"));
    EXPECT_EQ(check.wait(60), 0) << file << "\n" << check.out() << check.err();
    EXPECT_THAT(check.out(), HasSubstr("Every signal reads"));
  }
}

TEST_F(ProgramBenchCommand, CheckReadsItsSignalsAndListsWhatTheyGuard) {
  Process check({EMTB, "bench", "check", write("desk.yaml", desk()).string()}, path("check"));
  EXPECT_EQ(check.wait(60), 0) << check.err();
  EXPECT_THAT(check.out(),
              HasSubstr("guard: limits.omega, 280 rad/s: motor (program /usr/bin/python3), which reads -400 to "
                        "400 rad/s, says so within 0.205 s"));
  EXPECT_THAT(check.out(), HasSubstr("Every signal reads"));
}

}  // namespace
}  // namespace emtb
