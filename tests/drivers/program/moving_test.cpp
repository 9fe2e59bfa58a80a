#include <gmock/gmock.h>
#include <poll.h>
#include <unistd.h>

#include <cmath>

#include "config/guards.h"
#include "drivers/program/child.h"
#include "drivers/program/message.h"
#include "drivers/registry.h"
#include "hal/error.h"
#include "tests/drivers/device_log.h"
#include "tests/drivers/opened_bench.h"
#include "tests/drivers/program/python_device.h"

namespace emtb::program {
namespace {

using testing::HasSubstr;

/// A bench whose reference is the output of a program.
class MovingProgram : public PythonFolder {
 protected:
  void open(const std::string& program, const std::string& channels = "") {
    bench = open_bench(read_bench(bench_of(program, ", moves: true" + channels)));
  }
  bool comes(double volts) {
    return eventually([&] { return at_the_pins() == volts; }, 20);
  }

  Bench bench;
};

TEST_F(MovingProgram, SetsWhatItIsToldWithinItsLimitsAndMeasures) {
  open(shipped("toy_motor.py"), ", channels: {e_a: {period: 0.01}, omega: {period: 0.01}}");
  ASSERT_EQ(bench.inputs.size(), 1U);
  DeviceLog log(*bench.inputs[0]);
  log.begin();
  const auto comes = [&](double volts) { return log.comes([&] { return log.last(Signal::e_a) == volts; }); };
  EXPECT_EQ(bench.reference->set(2), Fault::none);
  EXPECT_TRUE(comes(4));
  EXPECT_EQ(bench.reference->set(99), Fault::none);
  EXPECT_TRUE(comes(12)) << "6 V are the most";
  EXPECT_TRUE(log.comes([&] { return log.last(Signal::omega) > 100; }));
  EXPECT_EQ(bench.reference->set(std::nan("")), Fault::non_finite);
  EXPECT_TRUE(comes(0));
  EXPECT_EQ(bench.reference->set(1), Fault::none);
  EXPECT_TRUE(comes(2));
  EXPECT_EQ(bench.reference->make_safe(), Fault::none);
  EXPECT_TRUE(comes(0));
  EXPECT_TRUE(log.faults.empty());
}

TEST_F(MovingProgram, IsSafeAfterItWasClosed) {
  open(mover());
  EXPECT_EQ(bench.reference->set(2), Fault::none);
  ASSERT_TRUE(comes(2));
  bench.reference.reset();
  EXPECT_EQ(at_the_pins(), 0);
}

TEST_F(MovingProgram, AnOutputThatDoesNotFollowIsAFaultUntilItIsMadeSafe) {
  open(mover("put(min(volts, 1.0))"));
  EXPECT_EQ(bench.reference->set(1), Fault::none);
  ASSERT_TRUE(comes(1));
  bench.reference->set(3);
  EXPECT_TRUE(eventually([&] { return bench.reference->set(3) == Fault::output_failed; }));
  EXPECT_TRUE(eventually([&] { return bench.reference->make_safe() == Fault::none; }));
  EXPECT_TRUE(comes(0));
  EXPECT_EQ(bench.reference->set(0.5), Fault::none);
}

TEST_F(MovingProgram, FollowsARampWithoutAFault) {
  open(mover());
  for (int n = 0; n <= 600; ++n) {
    ASSERT_EQ(bench.reference->set(n * 0.01), Fault::none) << n;
    usleep(1000);
  }
  EXPECT_TRUE(comes(6));
}

TEST_F(MovingProgram, OneThatDiesIsStartedAgainAndSafe) {
  open(mover("put(volts)\n      if volts == 5: os._exit(9)"));
  bench.reference->set(5);
  EXPECT_TRUE(eventually([&] { return bench.reference->set(5) == Fault::output_failed; }));
  bench.reference->make_safe();
  EXPECT_TRUE(comes(0)) << "by the next process, whatever the loop wants of it";
  EXPECT_TRUE(eventually([&] { return bench.reference->make_safe() == Fault::none; }));
}

TEST_F(MovingProgram, IsNotOpenedBeforeItSaysThatItIsSafe) {
  EXPECT_THAT(refusal_of([&] { open(mover("put(3.0)"), ", start_up: 4"); }),
              HasSubstr("cell: /usr/bin/python3: does not say `out=` with the safe value that it was told"));
}

TEST_F(MovingProgram, StaysSafeWhereABenchIsOnlyLookedAt) {
  const BenchConfig config =
      read_bench(bench_of(shipped("toy_motor.py"), ", moves: true, channels: {e_a: {period: 0.01}}"));
  const BenchInputs inputs = open_inputs(config);
  ASSERT_EQ(inputs.devices.size(), 1U);
  EXPECT_EQ(inputs.devices[0].why_not, "");
  ASSERT_TRUE(inputs.devices[0].input);
  DeviceLog log(*inputs.devices[0].input);
  EXPECT_TRUE(log.comes([&] { return log.of(Signal::e_a).size() > 20; })) << "though its lines say `out=` as well";
  EXPECT_EQ(log.last(Signal::e_a), 0);
}

TEST_F(MovingProgram, ALimitOnItsSignalIsGuardedByTheRangeThatItSays) {
  const BenchConfig config = read_bench(write("desk.yaml", desk()));
  bench = open_bench(config);
  const std::vector<Guard> guards = guards_of(config, bench.inputs[0]->channels());
  ASSERT_EQ(guards.size(), 1U);
  EXPECT_EQ(guards[0].text,
            "limits.omega, 280 rad/s: motor (program /usr/bin/python3), which reads -400 to 400 rad/s, says so within "
            "0.205 s");
  EXPECT_EQ(guards[0].wrong, "");
}

TEST_F(MovingProgram, CanBeMadeSafeByItself) {
  const Bench safe = open_reference(read_bench(bench_of(mover(), ", moves: true")));
  EXPECT_EQ(safe.reference->make_safe(), Fault::none);
  EXPECT_EQ(at_the_pins(), 0);
}

/// The shipped example alone, spoken to by the test.
class ToyMotor : public PythonFolder {
 protected:
  /// Waits for a line that says that the output is at so many volts. @return [s] that took; below 0: it did not come
  double comes(const std::string& line) {
    const auto begin = std::chrono::steady_clock::now();
    const auto took = [&] { return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count(); };
    std::string heard;
    while (took() < 20) {
      char buffer[4096];
      const ssize_t got = ::read(motor.out(), buffer, sizeof buffer);
      if (got > 0) heard.append(buffer, static_cast<std::size_t>(got));
      if (heard.find(line) != std::string::npos) return took();
      usleep(1000);
    }
    return -1;
  }

  Child motor{{.command = {"/usr/bin/python3", shipped("toy_motor.py")},
               .folder = path(""),
               .user = geteuid() == 0 ? "nobody" : ""}};
};

TEST_F(ToyMotor, GoesSafeByItselfWhereTheDaemonHangs) {
  motor.say(greeting);
  ASSERT_GE(comes("emtb 1 toy motor\n"), 0);
  motor.say("set 3\n");
  ASSERT_GE(comes("out=3\n"), 0);
  EXPECT_GT(comes("out=0\n"), 0.1) << "0.2 s after the last `set`";
}

TEST_F(ToyMotor, EndsWithTheEndOfItsStdin) {
  motor.say("emtb 1\nset 3\n");
  ASSERT_GE(comes("out=3\n"), 0);
  motor.hang_up();
  EXPECT_EQ(motor.ended(20), "it ended with code 0");
}

}  // namespace
}  // namespace emtb::program
