#include "drivers/program/device.h"

#include <gmock/gmock.h>
#include <sched.h>
#include <signal.h>
#include <sys/resource.h>

#include <chrono>

#include "drivers/program/open.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/opened_bench.h"
#include "tests/drivers/program/python_device.h"

namespace emtb::program {
namespace {

using testing::HasSubstr;
using testing::Not;

/// A device that only measures. The loop's part is played by the test.
class MeasuringProgram : public PythonFolder {
 protected:
  /// @param body of the program @param more keys of the device
  void open(const std::string& body, const std::string& channels = "omega: {period: 0.02}",
            const std::string& more = "") {
    const BenchConfig bench = read_bench(bench_of(python(body), ", channels: {" + channels + "}" + more));
    device = std::make_unique<Device>("cell", std::make_shared<MonotonicClock>(),
                                      read_settings(bench.devices[0].yaml, nullptr));
    input = std::make_unique<AsInput>(*device);
    log.emplace(*input);
  }
  std::string refusal(const std::string& body, const std::string& more = ", start_up: 5") {
    return refusal_of([&] { open(body, "omega: {period: 0.02}", more); });
  }

  struct AsInput final : InputDevice {
    explicit AsInput(Device& of) : device(of) {}
    std::span<const Channel> channels() const noexcept override { return device.channels(); }
    void start() override { device.start(); }
    Readings read(std::span<Reading> out) noexcept override { return device.read(out); }
    Device& device;
  };

  std::unique_ptr<Device> device;
  std::unique_ptr<InputDevice> input;
  std::optional<DeviceLog> log;
};

/// Forever: a reading each 20 ms.
const std::string steady = "hello()\nwhile True:\n  say('omega=80.5')\n  time.sleep(0.02)\n";

TEST_F(MeasuringProgram, GivesItsReadingsInSiUnitsAtTheTimesThatItSays) {
  open(
      "hello()\nn = 0\nwhile True:\n  n += 1\n  say(f'i_a={500 + n} omega=3000 t={now() - 0.05}')\n  "
      "time.sleep(0.02)\n",
      "i_a: {period: 0.02, window: 0.01, latency: 0.1, unit: mA, offset: 30, range: 2000, resolution: 1}, "
      "omega: {period: 0.02, unit: rpm, scale: -1}");
  MonotonicClock clock;
  ASSERT_TRUE(log->comes([&] { return log->of(Signal::i_a).size() >= 5; }));
  const double late = clock.now() - log->of(Signal::i_a).back().time;
  EXPECT_DOUBLE_EQ(log->of(Signal::i_a)[0].value, 0.531);
  EXPECT_NEAR(log->last(Signal::omega), -3000 * M_PI / 30, 1e-9);
  EXPECT_GE(late, 0.15) << "of `t`, and of the latency";
  EXPECT_LT(log->of(Signal::i_a)[0].time + 0.0999, log->of(Signal::omega)[0].time) << "the latency is of the channel";
  EXPECT_TRUE(log->faults.empty());
  const Channel& current = device->channels()[0];
  EXPECT_DOUBLE_EQ(current.high, 2);
  EXPECT_DOUBLE_EQ(current.lsb, 1e-3);
  EXPECT_DOUBLE_EQ(current.window, 0.01);
}

TEST_F(MeasuringProgram, WhatIsNoLineOfTheProtocolIsLeftOut) {
  open(
      "hello()\nwhile True:\n  for line in ('omega=80.5', 'Traceback', 'omega=7x', 'torque=7', 'x' * 5000, "
      "'omega=7 omega=7', f'omega=7 t={now() + 3}', 'omega=7 t=1', '\\x00\\xff'):\n"
      "    say(line)\n  time.sleep(1)\n",
      "omega: {period: 0.5}");
  ASSERT_TRUE(log->comes([&] { return log->readings.size() >= 3; }));
  for (const Reading& reading : log->readings) EXPECT_EQ(reading.value, 80.5);
  EXPECT_TRUE(log->faults.empty()) << "ten a second are borne";
}

TEST_F(MeasuringProgram, MuchThatMeansNothingIsAFaultByItself) {
  open("hello()\nwhile True:\n  say('omega=80.5')\n  say('?!')\n  time.sleep(0.01)\n", "omega: {period: 0.01}");
  EXPECT_TRUE(log->comes([&] { return log->faults.contains(Fault::scan_broken); }));
  EXPECT_FALSE(log->faults.contains(Fault::device_lost));
}

TEST_F(MeasuringProgram, ItsSilenceIsALostDeviceAndItIsStartedAgain) {
  open("hello()\nfor n in range(20):\n  say('omega=80.5')\n  time.sleep(0.02)\ntime.sleep(1000)\n");
  ASSERT_TRUE(log->comes_reading(80.5));
  const pid_t first = device->pid();
  ASSERT_TRUE(log->comes_fault(Fault::device_lost));
  ASSERT_TRUE(log->comes_reading(80.5)) << "of the next process, and the fault is over";
  EXPECT_NE(device->pid(), first);
  EXPECT_EQ(kill(first, 0), -1) << "the silent one was killed";
}

TEST_F(MeasuringProgram, OnlyGarbageIsSilence) {
  open(
      "hello()\nfor n in range(20):\n  say('omega=80.5')\n  time.sleep(0.02)\nwhile True:\n  say('omega=?')\n  "
      "time.sleep(0.1)\n");
  ASSERT_TRUE(log->comes_reading(80.5));
  EXPECT_TRUE(log->comes_fault(Fault::device_lost));
}

TEST_F(MeasuringProgram, ItsDeathIsALostDeviceAndItIsStartedAgain) {
  open(steady);
  ASSERT_TRUE(log->comes_reading(80.5));
  kill(device->pid(), SIGKILL);
  ASSERT_TRUE(log->comes_fault(Fault::device_lost));
  EXPECT_TRUE(log->comes_reading(80.5));
}

TEST_F(MeasuringProgram, AFloodOfLinesEndsIt) {
  open("hello()\nfor n in range(10):\n  say('omega=80.5')\n  time.sleep(0.02)\nwhile True: print('omega=80.5')\n");
  ASSERT_TRUE(log->comes_reading(80.5));
  EXPECT_TRUE(log->comes_fault(Fault::device_lost));
}

TEST_F(MeasuringProgram, ALineWithoutAnEndEndsIt) {
  open(
      "hello()\nfor n in range(10):\n  say('omega=80.5')\n  time.sleep(0.02)\n"
      "while True: os.write(1, b'omega=80.5 ' * 300)\n");
  ASSERT_TRUE(log->comes_reading(80.5));
  EXPECT_TRUE(log->comes_fault(Fault::device_lost));
}

TEST_F(MeasuringProgram, WhatItReportsItselfStandsUntilItsNextReading) {
  open(
      "hello()\nwhile True:\n  for line in ('omega=80.5',) * 20 + ('fault over_range',) * 20 + ('omega=inf',) * 20:\n"
      "    say(line)\n    time.sleep(0.02)\n");
  EXPECT_TRUE(log->comes_fault(Fault::over_range));
  EXPECT_TRUE(log->comes_fault(Fault::non_finite));
  EXPECT_TRUE(log->comes_reading(80.5));
  EXPECT_FALSE(log->faults.contains(Fault::device_lost));
}

TEST_F(MeasuringProgram, OneThatDoesNotStartSaysWhy) {
  EXPECT_THAT(refusal("raise ValueError('no such port')\n"),
              testing::MatchesRegex("cell: /usr/bin/python3: it ended with code 1: ValueError: no such port"));
  EXPECT_THAT(refusal("time.sleep(1000)\n", ", start_up: 0.5"), HasSubstr("does not say hello: `emtb 1 NAME`"));
  EXPECT_THAT(refusal("say('Hello, World')\ntime.sleep(1000)\n", ", start_up: 4"),
              HasSubstr("does not say hello: `emtb 1 NAME`; it said `Hello, World`"));
  EXPECT_THAT(refusal("say('emtb 7 mine')\ntime.sleep(1000)\n"),
              HasSubstr("speaks version 7 of the protocol, emtb version 1"));
  EXPECT_THAT(refusal("os.kill(os.getpid(), 11)\n"), HasSubstr("it was ended by SIGSEGV"));
  EXPECT_THAT(refusal("print('\\x1b[31mred\\x07', file=sys.stderr)\nsys.exit(3)\n"), Not(HasSubstr("\x1b")));
}

TEST_F(MeasuringProgram, ADeafOneIsKilledAtOnce) {
  open("import signal\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n" + steady);
  ASSERT_TRUE(log->comes_reading(80.5));
  const pid_t process = device->pid();
  kill(process, SIGTERM);
  const auto begin = std::chrono::steady_clock::now();
  device.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::milliseconds(900));
  EXPECT_EQ(kill(process, 0), -1);
  EXPECT_EQ(errno, ESRCH);
}

/// The process that starts the program, with all that a daemon has: descriptors, priority, one processor.
class Privileged {
 public:
  Privileged() : file_(::open("/dev/null", O_RDONLY)) {
    sched_getaffinity(0, sizeof before_, &before_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int cpu = 0; cpu < CPU_SETSIZE && CPU_COUNT(&one) == 0; ++cpu) {
      if (CPU_ISSET(cpu, &before_)) CPU_SET(cpu, &one);
    }
    sched_setaffinity(0, sizeof one, &one);
    const sched_param fifo{.sched_priority = 10};
    real_time_ = sched_setscheduler(0, SCHED_FIFO, &fifo) == 0;  // where we may
    setenv("NOTIFY_SOCKET", "/run/systemd/notify", 1);
    signal(SIGPIPE, SIG_IGN);
  }
  ~Privileged() {
    const sched_param none{};
    sched_setscheduler(0, SCHED_OTHER, &none);
    sched_setaffinity(0, sizeof before_, &before_);
    unsetenv("NOTIFY_SOCKET");
    signal(SIGPIPE, SIG_DFL);
    ::close(file_);
  }
  int processors() const { return CPU_COUNT(&before_); }

 private:
  int file_;
  cpu_set_t before_{};
  bool real_time_ = false;
};

TEST_F(MeasuringProgram, HasNothingOfTheDaemonButThreePipes) {
  const Privileged we;
  const std::string said = refusal(
      "import resource, signal, threading\n"
      "status = dict(line.rstrip().split(':\\t', 1) for line in open('/proc/self/status'))\n"
      "def tried(what):\n"
      "  try: what()\n"
      "  except OSError as e: return e.errno\n"
      "  return 'done'\n"
      "thread = threading.Thread(target=lambda: None); thread.start(); thread.join()\n"
      "files = [f for f in os.listdir('/proc/self/fd') if os.path.exists(f'/proc/self/fd/{f}')]\n"
      "sys.exit(f'files={len(files)} policy={os.sched_getscheduler(0)} cpus={len(os.sched_getaffinity(0))} '\n"
      "  f'nice={max(0, -os.nice(0))} rtprio={resource.getrlimit(resource.RLIMIT_RTPRIO)[1]} '\n"
      "  f'new={status[\"NoNewPrivs\"]} caps={status[\"CapEff\"].strip(\"0\")} fork={tried(os.fork)} '\n"
      "  f'notify={os.environ.get(\"NOTIFY_SOCKET\")} pipe={signal.getsignal(signal.SIGPIPE) == signal.SIG_IGN} '\n"
      "  f'root={os.geteuid() == 0} session={os.getsid(0) == os.getpid()} there={os.path.exists(\"bench.yaml\")}')\n");
  // Python itself ignores SIGPIPE.
  EXPECT_THAT(said, HasSubstr(": files=3 policy=0 cpus=" + std::to_string(we.processors()) +
                              " nice=0 rtprio=0 new=1 caps= fork=1 notify=None pipe=True root=False session=True "
                              "there=True"));
}

TEST_F(MeasuringProgram, IsOursWhereACopyOfOurBenchNamesIt) {
  const auto command_of = [&](const std::string& words) {
    const BenchConfig bench = read_bench(write("b.yaml",
                                               "name: b\nreference: {device: cell, min: 0, max: 6, safe: 0}\n"
                                               "devices:\n  cell: {driver: program, moves: true, command: [" +
                                                   words + "]}\n"));
    return read_settings(bench.devices[0].yaml, &bench.reference).child.command;
  };
  EXPECT_EQ(command_of("python3, ../devices/toy_motor.py, ../devices/absent.py, other/toy_motor.py"),
            (std::vector<std::string>{"/usr/bin/python3", EMTB_SOURCE_DIR "/config/devices/toy_motor.py",
                                      "../devices/absent.py", "other/toy_motor.py"}));
  write("devices/toy_motor.py", "");
  EXPECT_EQ(command_of("python3, devices/toy_motor.py").at(1), "devices/toy_motor.py") << "its own goes first";
}

TEST_F(MeasuringProgram, ComplainsOfWhatCannotBe) {
  const auto settings_with = [&](const std::string& more) {
    const BenchConfig bench = read_bench(write("b.yaml",
                                               "name: b\nreference: {device: cell, min: 0, max: 6, safe: 0}\n"
                                               "devices:\n  cell: {driver: program, " +
                                                   more + "}\n"));
    return read_settings(bench.devices[0].yaml, &bench.reference);
  };
  const auto with = [&](const std::string& more) { return refusal_of([&] { settings_with(more); }); };
  const std::string python = "command: [python3, x.py]" + its_user();
  EXPECT_THAT(
      with(python + ", channels: {omega: {period: 1}}"),
      HasSubstr("b.yaml:2: reference.device is `cell`, a program, which moves nothing unless it says so: moves: "
                "true"));
  EXPECT_THAT(
      with("command: [" + path("absent.py").string() + "], moves: true"),
      HasSubstr("b.yaml:4: devices.cell.command names `" + path("absent.py").string() + "`, which is no program"));
  EXPECT_THAT(with(python + ", moves: true, gain: 2"), HasSubstr("devices.cell.gain is not known here"));
  EXPECT_THAT(with(python + ", moves: true, channels: {u_ref: {period: 1}}"), HasSubstr("cannot be measured here"));
  EXPECT_THAT(with(python + ", moves: true, channels: {omega: {period: 0.0001}}"), HasSubstr("period is 0.0001"));
  if (geteuid() == 0) {
    EXPECT_EQ(settings_with("command: [python3], moves: true").child.user, "nobody")
        << "root starts no program with its own rights";
    EXPECT_THAT(with("command: [python3], user: root, moves: true"), HasSubstr("user is root. Write another"));
  } else {
    EXPECT_THAT(with("command: [python3], user: nobody, moves: true"),
                HasSubstr("only root can start a program as another"));
  }
  EXPECT_THAT(with("command: [python3], user: nobody-of-us, moves: true"),
              HasSubstr("whom this computer does not know"));
}

}  // namespace
}  // namespace emtb::program
