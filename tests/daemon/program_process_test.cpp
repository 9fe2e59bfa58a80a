#include <gmock/gmock.h>
#include <signal.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>

#include "session/session.h"
#include "session/spec.h"
#include "tests/drivers/program/python_device.h"
#include "tests/emtbd.h"

namespace emtb::program {
namespace {

using nlohmann::json;
using testing::AnyOf;
using testing::HasSubstr;

const char* const three_volts = "name: endless\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n";
const char* const still = "name: still\nkind: step\nlevel: 0.1\nbefore: 0\nhold: 100\nafter: 0\n";

/// The real daemon on a bench whose device is a program in Python.
class ProgramBench : public PythonFolder {
 protected:
  void launch(const std::string& bench) {
    emtbd = std::make_unique<Process>(emtbd_words(write("bench.yaml", bench), path("")), path("emtbd"));
    daemon = client_of(*emtbd, path("s"));
  }
  /// A card that is simulated, and beside it a program that measures the current.
  std::string with_meter(const std::string& body) const {
    return "name: b\nrate: 200\nreference: {device: card, min: 0, max: 6, safe: 0}\nlimits: {i_a: 2}\n"
           "simulation: {driver: {gain: 18}, motor: {R_a: 32, K_b: 0.67, K_m: 0.67, J: 0.0034}}\ndevices:\n"
           "  card: {driver: simulated_daq, channels: {omega: {range: [-200, 200]}}}\n"
           "  meter: {driver: program, command: [python3, " +
           python(body) + "]" + its_user() + ", channels: {i_a: {period: 0.2, range: 3}}}\n";
  }
  std::string moving(const std::string& program) const { return read(bench_of(program, ", moves: true")); }

  /// The program's process, whichever thread of the daemon has started it; 0: there is none.
  int program() const {
    const std::filesystem::path tasks = "/proc/" + std::to_string(emtbd->pid()) + "/task";
    std::error_code gone;
    for (const auto& task : std::filesystem::directory_iterator(tasks, gone)) {
      std::ifstream children(task.path() / "children");
      for (int child = 0; children >> child;) {
        if (read("/proc/" + std::to_string(child) + "/comm").starts_with("python3")) return child;
      }
    }
    return 0;
  }
  /// A process that nobody has waited for is none.
  static bool lives(int process) {
    const std::string stat = read("/proc/" + std::to_string(process) + "/stat");
    const std::size_t state = stat.rfind(") ");
    return state != std::string::npos && stat[state + 2] != 'Z';
  }
  bool puts_out(double volts) {
    return eventually([&] { return read(path("output")) != "" && at_the_pins() == volts; }, 20);
  }

  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Client> daemon;
};

const std::string steady = "hello()\nwhile True:\n  say('i_a=0.53')\n  time.sleep(0.05)\n";

TEST_F(ProgramBench, RunsAStepThroughTheShippedExample) {
  launch(desk());
  ASSERT_TRUE(daemon) << emtbd->err();
  EXPECT_THAT(emtbd->err(), HasSubstr("limits.omega, 280 rad/s: motor (program /usr/bin/python3)"));
  const json end = run_to_its_end(*daemon, "name: step\nkind: step\nlevel: 3\nbefore: 0.5\nhold: 2\nafter: 0.5\n");
  ASSERT_EQ(end["outcome"], "done") << end << emtbd->err();
  const Run run = read_session(end["session"].get<std::string>()).runs.at(0);
  const auto largest = [&](Signal signal) { return *std::ranges::max_element(run.at(signal).value); };
  EXPECT_DOUBLE_EQ(largest(Signal::e_a), 6);
  EXPECT_NEAR(largest(Signal::omega), 120, 2);
  EXPECT_DOUBLE_EQ(run.at(Signal::e_a).value.front(), 0);
}

TEST_F(ProgramBench, TheDeathOfAProgramEndsTheRunAsALostDevice) {
  launch(with_meter(steady));
  ASSERT_TRUE(daemon) << emtbd->err();
  begin_run(*daemon, still);
  const int first = program();
  ASSERT_GT(first, 0);
  kill(first, SIGKILL);
  const json end = end_of_run(*daemon);
  EXPECT_EQ(end["outcome"], "fault") << end;
  EXPECT_EQ(end["fault"]["code"], 301) << end;
  EXPECT_EQ(daemon->call("status", {})["state"], "latched");
  EXPECT_THAT(emtbd->err(), HasSubstr("meter: lost: /usr/bin/python3: it was ended by SIGKILL"));
  EXPECT_TRUE(eventually([&] {
    try {
      return !daemon->call("reset", {}).is_null();
    } catch (const ProtocolError&) {  // it is started again, but does not measure yet
      return false;
    }
  }));
}

TEST_F(ProgramBench, TheSilenceOfAProgramEndsTheRunAsALostDevice) {
  launch(with_meter(steady));
  ASSERT_TRUE(daemon) << emtbd->err();
  begin_run(*daemon, still);
  const int first = program();
  kill(first, SIGSTOP);
  const json end = end_of_run(*daemon);
  EXPECT_EQ(end["fault"]["code"], 301) << end;
  EXPECT_TRUE(eventually([&] { return !lives(first); })) << "it is not waited for";
}

TEST_F(ProgramBench, DiesWithTheDaemonAndTheGuardiansOwnMakesSafe) {
  launch(moving(mover()));
  ASSERT_TRUE(daemon) << emtbd->err();
  begin_run(*daemon, three_volts);
  ASSERT_TRUE(puts_out(3));
  const int process = program();
  emtbd->signal(SIGKILL);
  emtbd->wait();
  EXPECT_TRUE(eventually([&] { return !lives(process); }, 20));
  EXPECT_TRUE(puts_out(0));
}

TEST_F(ProgramBench, DiesWithTheDaemonWithoutAGuardianToo) {
  // Deaf to everything, the end of its stdin included; 3 V stand for good.
  launch(moving(mover("put(volts)\n      if volts == 3:\n        while True: say('out=3'); time.sleep(0.05)")));
  ASSERT_TRUE(daemon) << emtbd->err();
  begin_run(*daemon, three_volts);
  ASSERT_TRUE(puts_out(3));
  const int process = program();
  ASSERT_TRUE(kill_with_guardian(*emtbd));
  EXPECT_TRUE(eventually([&] { return !lives(process); }, 20));
  EXPECT_EQ(at_the_pins(), 3);
  Process safe({EMTB_SAFE, "--config", path("bench.yaml").string()}, path("safe"));
  EXPECT_EQ(safe.wait(), 0) << safe.err();
  EXPECT_EQ(at_the_pins(), 0);
}

TEST_F(ProgramBench, GoesSafeByItselfWhereTheDaemonHangs) {
  launch(moving(mover()));
  ASSERT_TRUE(daemon) << emtbd->err();
  begin_run(*daemon, three_volts);
  ASSERT_TRUE(puts_out(3));
  emtbd->signal(SIGSTOP);
  EXPECT_TRUE(puts_out(0));
  emtbd->signal(SIGCONT);
  EXPECT_THAT(end_of_run(*daemon)["outcome"].get<std::string>(), testing::Not("done"));
}

TEST_F(ProgramBench, ADeafProgramDelaysNoStop) {
  launch(with_meter("import signal\nfor n in (1, 2, 3, 15): signal.signal(n, signal.SIG_IGN)\n" + steady));
  ASSERT_TRUE(daemon) << emtbd->err();
  const int process = program();
  ASSERT_GT(process, 0);
  const auto begin = std::chrono::steady_clock::now();
  kill(process, SIGTERM);  // as systemd does to all processes of the service
  emtbd->signal(SIGTERM);
  EXPECT_EQ(emtbd->wait(), 0);
  EXPECT_FALSE(lives(process)) << "none is left behind in the control group";
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(5));
}

TEST_F(ProgramBench, IsNoOutputUnlessTheBenchFileSaysSo) {
  Process refused(emtbd_words(bench_of(mover(), ", channels: {omega: {period: 0.2}}"), path("")), path("emtbd"));
  EXPECT_EQ(refused.wait(), 2);
  EXPECT_THAT(refused.err(),
              HasSubstr("bench.yaml:3: reference.device is `cell`, a program, which moves nothing unless it "
                        "says so: moves: true"));
  EXPECT_FALSE(std::filesystem::exists(path("output"))) << "it was not even started";
}

}  // namespace
}  // namespace emtb::program
