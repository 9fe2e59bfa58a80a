#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sched.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <nlohmann/json.hpp>
#include <random>

#include "session/session.h"
#include "session/spec.h"
#include "tests/emtbd.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

const char* const hundred_seconds = "name: endless\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n";

/// The real program on the simulated FH2 bench, on a copy of the bench file: its lock is per file.
class ProcessTest : public Scratch {
 protected:
  ProcessTest() {
    bench = write("bench.yaml", read(std::filesystem::path(EMTB_CONFIG) / "benches/fh2-simulated.yaml"));
  }

  std::unique_ptr<Process> launch(const std::vector<std::string>& more = {}) {
    return std::make_unique<Process>(emtbd_words(bench, path(""), more), path("emtbd" + std::to_string(++launched_)));
  }
  std::unique_ptr<Client> client(Process& emtbd) { return client_of(emtbd, path("s")); }

  void expect_refusal(Process& process, const std::string& words) {
    EXPECT_EQ(process.wait(), 2);
    EXPECT_THAT(process.err(), HasSubstr(words));
    EXPECT_EQ(std::ranges::count(process.err(), '\n'), 1) << process.err();
    EXPECT_EQ(process.out(), "");
  }

  /// A run at real time, `seconds` of it gone; its session's path.
  std::string run_for(Client& daemon, double seconds) {
    daemon.call("reset", {});
    const json run = daemon.call("run", {{"profile", hundred_seconds}});
    EXPECT_TRUE(eventually([&] {
      const json now = daemon.call("status", {});
      return now["run"].is_object() && now["run"]["t"] >= seconds;
    }));
    return run["session"];
  }

  std::filesystem::path bench;

 private:
  int launched_ = 0;
};

TEST_F(ProcessTest, RunsAShippedProfileAsFastAsPossible) {
  const auto emtbd = launch({"--pace", "max"});
  const auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  const json end = run_to_its_end(*daemon, "fh2_step_high");
  EXPECT_EQ(end["outcome"], "done") << end;
  const Session session = read_session(end["session"].get<std::string>());
  EXPECT_TRUE(session.complete);
  EXPECT_EQ(session.config, read(bench));
  ASSERT_EQ(session.runs.size(), 1u);
  const Run& run = session.runs[0];
  EXPECT_NEAR(run.duration(), 30, 0.01);
  EXPECT_NEAR(static_cast<double>(run.at(Signal::omega).t.size()), 30'000, 10) << "nothing is lost at full speed";
  EXPECT_NEAR(static_cast<double>(run.at(Signal::i_a).t.size()), 75, 2);
  EXPECT_NEAR(*std::ranges::max_element(run.at(Signal::omega).value), 158, 5);
  EXPECT_TRUE(std::ranges::none_of(session.events, [](const Event& e) { return e.code == event_code::gap; }));
  daemon->call("status", {});

  emtbd->signal(SIGTERM);
  EXPECT_EQ(emtbd->wait(), 0);
  EXPECT_FALSE(std::filesystem::exists(path("s")));
}

TEST_F(ProcessTest, RunsAnExampleOfEachFurtherKindOfProfile) {
  for (const std::string of : {"fh2", "desk"}) {
    bench = write(of + ".yaml", read(std::filesystem::path(EMTB_CONFIG) / "benches" / (of + "-simulated.yaml")));
    const auto emtbd = launch({"--pace", "max"});
    const auto daemon = client(*emtbd);
    ASSERT_TRUE(daemon) << emtbd->err();
    for (const std::string kind : {"coast_down", "chirp", "heat_soak", "from_csv", "reversal"}) {
      if (of == "fh2" && kind == "reversal") continue;  // its driver has one direction
      const json end = run_to_its_end(*daemon, of + "_" + kind);
      EXPECT_EQ(end["outcome"], "done") << of << " " << kind << ": " << end;
    }
  }
}

TEST_F(ProcessTest, KilledInMidRunItLeavesAllButTheLastQuarterOfASecond) {
  auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  run_for(*daemon, 2);
  const json last = daemon->call("status", {});
  emtbd->signal(SIGKILL);
  EXPECT_EQ(emtbd->wait(), 128 + SIGKILL);
  daemon.reset();

  emtbd = launch();
  daemon = client(*emtbd);  // on the socket that the dead one left behind
  ASSERT_TRUE(daemon) << emtbd->err();
  Session session;
  EXPECT_TRUE(eventually([&] {  // it is repaired while the bench is in service already
    session = read_session(last["run"]["session"].get<std::string>());
    return std::ranges::any_of(session.events, [](const Event& e) { return e.code == event_code::repaired; });
  }));
  EXPECT_FALSE(session.complete);
  ASSERT_EQ(session.runs.size(), 1u);
  const Series& omega = session.runs[0].at(Signal::omega);
  EXPECT_GT(omega.t.back(), last["run"]["t"].get<double>() - 0.25);
  EXPECT_GT(static_cast<double>(omega.t.size()), 0.8 * omega.t.back() * 1000);
  EXPECT_EQ(daemon->call("status", {})["state"], "latched") << "it never goes on by itself";
}

/// HDF5 crashes on about one in six of these: bytes of what it keeps of the file's texts.
TEST_F(ProcessTest, WhatDamagedSessionsDoToTheirRepairKeepsNoDaemonFromService) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer catches the signal that a damaged file kills its repair with";
#endif
  auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  const std::filesystem::path file = run_for(*daemon, 0.2);
  emtbd->signal(SIGKILL);
  emtbd->wait();
  daemon.reset();
  const std::string whole = read(file);
  constexpr int copies = 60;
  std::mt19937 random(21);
  for (int i = 0; i < copies; ++i) {
    std::string changed = whole;
    changed[4096 + random() % 1000] = static_cast<char>(random());
    write("data/damaged" + std::to_string(i) + ".h5", changed);
  }
  ASSERT_EQ(mkfifo(path("data/a.h5").c_str(), 0600), 0);
  write("data/b.h5", "");

  emtbd = launch();
  daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  EXPECT_EQ(run_to_its_end(*daemon, "name: short\nkind: step\nlevel: 3\nbefore: 0\nhold: 0.2\nafter: 0\n")["outcome"],
            "done")
      << "the bench is in service meanwhile";
  EXPECT_TRUE(eventually([&] {
    return emtbd->err().find(file.string() + ": its recording had") != std::string::npos ||
           read_session(file).events.back().code == event_code::repaired;
  }));
  const auto aside = [&] {
    int count = 0;
    for (const auto& entry : std::filesystem::directory_iterator(path("data"))) {
      count += entry.path().extension() == ".unreadable";
    }
    return count;
  };
  EXPECT_TRUE(eventually([&] { return aside() > 0; }));
  EXPECT_THAT(emtbd->err(), HasSubstr(".h5.unreadable now"));
  emtbd->signal(SIGTERM);
  EXPECT_EQ(emtbd->wait(), 0);
}

TEST_F(ProcessTest, SigtermInMidRunMakesSafeAndCompletesTheSession) {
  for (const int signal : {SIGTERM, SIGINT}) {
    const auto emtbd = launch();
    const auto daemon = client(*emtbd);
    ASSERT_TRUE(daemon) << emtbd->err();
    const std::string file = run_for(*daemon, 0.3);
    emtbd->signal(signal);
    EXPECT_EQ(emtbd->wait(), 0) << emtbd->err();
    const Session session = read_session(file);
    EXPECT_TRUE(session.complete);
    EXPECT_TRUE(std::ranges::any_of(session.events, [](const Event& e) { return e.code == 701; }));
    const Series& u = session.runs.at(0).at(Signal::u_ref);
    EXPECT_NEAR(u.value[u.value.size() / 2], 3, 0.01) << "it did run";
  }
}

TEST_F(ProcessTest, TellsHowPunctualTheLoopIsLiveAndInTheSession) {
  const auto emtbd = launch();
  const auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  const std::string file = run_for(*daemon, 0.3);
  const json loop = daemon->call("status", {})["loop"];
  EXPECT_GT(loop["work_us"]["p50"], 0);
  EXPECT_LE(loop["late_us"]["p50"], loop["late_us"]["p999"]);
  double counted = 0;
  for (const json& bin : loop["late_histogram"]) counted += bin[1].get<double>();
  EXPECT_NEAR(counted, loop["ticks"].get<double>(), 200);
  daemon->call("stop", {});
  ASSERT_TRUE(eventually([&] { return daemon->call("status", {})["run"].is_null(); }));
  const Session session = read_session(file);
  const auto figures = std::ranges::find(session.events, event_code::figures, &Event::code);
  ASSERT_NE(figures, session.events.end());
  EXPECT_THAT(figures->text, HasSubstr("woke late by"));
  EXPECT_THAT(figures->text, HasSubstr("deadlines missed"));
}

/// A process that is killed is gone, and its ExecStopPost starts, only when each of its threads had the processor
/// again.
TEST_F(ProcessTest, NoThreadKeepsItAliveByWaitingForAnIdleProcessor) {
  const auto emtbd = launch();
  ASSERT_TRUE(client(*emtbd)) << emtbd->err();
  int threads = 0;
  for (const auto& task : std::filesystem::directory_iterator("/proc/" + std::to_string(emtbd->pid()) + "/task")) {
    const int thread = std::stoi(task.path().filename());
    EXPECT_NE(sched_getscheduler(thread), SCHED_IDLE) << thread;
    EXPECT_LE(getpriority(PRIO_PROCESS, static_cast<id_t>(thread)), getpriority(PRIO_PROCESS, 0)) << thread;
    ++threads;
  }
  EXPECT_GE(threads, 5) << "loop, recorder, estimator, socket, the first";
}

TEST_F(ProcessTest, MalformedJsonGetsErrorsAndTheDaemonLives) {
  const auto emtbd = launch();
  const auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path("s").c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(connect(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  const std::string lines = "nonsense\n{}\n{\"jsonrpc\":\"2.0\",\"id\":3,\"method\":\"explode\"}\n\xff\n";
  ASSERT_EQ(send(socket, lines.data(), lines.size(), MSG_NOSIGNAL), static_cast<ssize_t>(lines.size()));
  std::string answers;
  while (std::ranges::count(answers, '\n') < 4) {
    char chunk[4096];
    const ssize_t n = recv(socket, chunk, sizeof chunk, 0);
    ASSERT_GT(n, 0);
    answers.append(chunk, static_cast<std::size_t>(n));
  }
  close(socket);
  EXPECT_THAT(answers, HasSubstr("-32700"));
  EXPECT_THAT(answers, HasSubstr("-32600"));
  EXPECT_THAT(answers, HasSubstr("-32601"));
  EXPECT_EQ(daemon->call("status", {})["state"], "latched");
}

TEST_F(ProcessTest, ASecondDaemonOnTheSameBenchDataOrSocketIsRefused) {
  const auto emtbd = launch();
  ASSERT_TRUE(client(*emtbd)) << emtbd->err();
  const auto other_bench = write("other.yaml", read(bench)).string();
  const auto data = path("data").string();
  const auto socket = path("s").string();
  Process same_bench({EMTBD, "--config", bench, "--socket", path("s2"), "--data", path("data2")}, path("1"));
  expect_refusal(same_bench, "another emtbd uses this bench");
  Process same_data({EMTBD, "--config", other_bench, "--socket", path("s2"), "--data", data}, path("2"));
  expect_refusal(same_data, "another emtbd uses this data folder");
  Process same_socket({EMTBD, "--config", other_bench, "--socket", socket, "--data", path("data2")}, path("3"));
  expect_refusal(same_socket, "another daemon answers there");
  EXPECT_EQ(client(*emtbd)->call("status", {})["state"], "latched") << "the first one does not mind";
}

TEST_F(ProcessTest, BadUseIsOneLineAndTwo) {
  const std::string socket = path("s").string();
  Process none({EMTBD, "--config", path("none.yaml")}, path("1"));
  expect_refusal(none, "none.yaml: cannot be read");
  const auto broken = write("broken.yaml", "name: x\nrate: fast\n").string();
  Process bad({EMTBD, "--config", broken, "--socket", socket}, path("2"));
  expect_refusal(bad, "broken.yaml:");
  Process unwritable({EMTBD, "--config", bench, "--socket", socket, "--data", "/proc/sessions"}, path("3"));
  expect_refusal(unwritable, "/proc/sessions: sessions cannot be written there");
  Process replay({EMTBD, "--config", bench, "--socket", socket, "--data", path("data"), "--replay", "x.h5"}, path("4"));
  expect_refusal(replay, "x.h5: ");
  Process option({EMTBD, "--config", bench, "--fast"}, path("5"));
  expect_refusal(option, "--fast");
  Process no_folder({EMTBD, "--config", bench, "--socket", path("no/s"), "--data", path("data")}, path("6"));
  expect_refusal(no_folder, "the socket cannot be made");
}

TEST_F(ProcessTest, SafeMakesSafeAndEnds) {
  Process safe({EMTBD, "--config", bench, "--safe"}, path("safe"));
  EXPECT_EQ(safe.wait(), 0) << safe.err();
  EXPECT_EQ(safe.err(), "");
}

TEST_F(ProcessTest, TellsSystemdWhenItIsReadyAndWhenItEnds) {
  const int notify = ::socket(AF_UNIX, SOCK_DGRAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path("notify").c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(bind(notify, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  setenv("NOTIFY_SOCKET", path("notify").c_str(), 1);
  setenv("WATCHDOG_USEC", "200000", 1);
  const auto emtbd = launch();
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
  std::string seen;
  const auto receive = [&] {
    char text[256];
    const ssize_t n = recv(notify, text, sizeof text, MSG_DONTWAIT);
    if (n > 0) seen.append(text, static_cast<std::size_t>(n)).append("\n");
  };
  const auto sees = [&](const char* what) {
    return eventually([&] {
      receive();
      return seen.find(what) != std::string::npos;
    });
  };
  EXPECT_TRUE(sees("READY=1"));
  EXPECT_TRUE(sees("WATCHDOG=1"));
  emtbd->signal(SIGTERM);
  EXPECT_TRUE(sees("STOPPING=1"));
  EXPECT_EQ(emtbd->wait(), 0);
  close(notify);
}

TEST_F(ProcessTest, ItsLogIsInUtcWhateverTheTimeZone) {
  setenv("TZ", "XYZ-5:30", 1);
  const auto emtbd = launch();
  unsetenv("TZ");
  ASSERT_TRUE(client(*emtbd)) << emtbd->err();
  const std::string log = emtbd->err();
  std::tm parts{};
  const char* const rest = strptime(log.c_str(), "%Y-%m-%dT%H:%M:%S", &parts);
  ASSERT_TRUE(rest) << log;
  EXPECT_THAT(std::string(rest, 5), testing::MatchesRegex("\\.[0-9][0-9][0-9]Z")) << log;
  EXPECT_NEAR(static_cast<double>(timegm(&parts)), static_cast<double>(std::time(nullptr)), 300);
}

/// Whatever it has, it refuses or it records: nothing that was begun dies of a lack of memory.
TEST_F(ProcessTest, WithLittleMemoryItRefusesInOneLineOrRunsToTheEnd) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer wants the whole address space";
#endif
  int refused = 0, done = 0;
  for (const int megabytes : {60, 100, 120, 130, 140, 160, 200, 300}) {
    std::string words = "ulimit -v " + std::to_string(megabytes * 1024) + "; exec";
    for (const std::string& word : emtbd_words(bench, path(""), {"--pace", "max"})) words += " " + word;
    Process emtbd({"/bin/sh", "-c", words}, path("limited"));
    const auto daemon = client(emtbd);
    if (!daemon) {
      EXPECT_EQ(emtbd.wait(), 2) << megabytes << " MB: " << emtbd.err();
      EXPECT_THAT(emtbd.err(), HasSubstr("emtbd: the memory that is free is not enough")) << megabytes << " MB";
      ++refused;
      continue;
    }
    try {
      EXPECT_EQ(run_to_its_end(*daemon, "fh2_step_low")["outcome"], "done") << megabytes << " MB: " << emtbd.err();
      ++done;
    } catch (const rpc::Refusal& e) {
      EXPECT_THAT(e.what(), HasSubstr("MB of memory, which are not free")) << megabytes << " MB";
      ++refused;
    }
    EXPECT_TRUE(daemon->call("status", {})["reference_safe"]) << megabytes << " MB";
    emtbd.signal(SIGTERM);
    EXPECT_EQ(emtbd.wait(), 0) << megabytes << " MB: " << emtbd.err();
  }
  EXPECT_GT(refused, 1);
  EXPECT_GT(done, 0);
}

TEST_F(ProcessTest, IdleCostsLittle) {
  const auto emtbd = launch({"--pace", "max"});
  const auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  const auto ticks = [&] { return daemon->call("status", {})["loop"]["ticks"].get<double>(); };
  const double before = ticks();
  const auto start = std::chrono::steady_clock::now();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const double passed = ticks() - before;
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  EXPECT_LT(passed, 1.2 * 1000 * took.count()) << "at --pace max it still idles at real time";
  EXPECT_GT(passed, 0);
}

}  // namespace
}  // namespace emtb
