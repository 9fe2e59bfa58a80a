#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "session/session.h"
#include "session/spec.h"
#include "tests/emtbd.h"
#include "tests/plant_bench.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;

/// Daemon and plant as two programs: the plant tells what its reference really was.
class DaemonAndPlant : public Scratch {
 protected:
  DaemonAndPlant() {
    bench_ = write("bench.yaml", name_.bench());
    plant_ = std::make_unique<Process>(
        std::vector<std::string>{EMTB_PLANT, "--config", bench_.string(), "--log", path("log").string()}, path("p"));
    EXPECT_TRUE(eventually([this] { return plant_->out().find("lives") != std::string::npos; })) << plant_->err();
  }

  std::unique_ptr<Process> launch() {
    return std::make_unique<Process>(emtbd_words(bench_, path("")), path("d" + std::to_string(++launched_)));
  }
  std::unique_ptr<Client> client(Process& emtbd) { return client_of(emtbd, path("s")); }
  /// A long run at 3 V, seen by the plant.
  std::string run(Client& daemon) {
    EXPECT_TRUE(eventually([&] {  // a machine that stalls may need a second attempt
      try {
        daemon.call("reset", {});
        return true;
      } catch (const rpc::Refusal&) {
        return false;
      }
    }));
    const json started =
        daemon.call("run", {{"profile", "name: long\nkind: step\nlevel: 3\nbefore: 0\nhold: 100\nafter: 0\n"}});
    EXPECT_TRUE(eventually([&] { return reference() == 3; }));
    return started["session"];
  }
  /// [V] as the plant logged it last.
  double reference() const {
    std::istringstream log(read(path("log")));
    double volts = -1;
    std::string line;
    while (std::getline(log, line)) {
      const auto comma = line.find(',');
      if (comma != std::string::npos && line[0] != 't' && line.size() > comma + 6)
        volts = std::stod(line.substr(comma + 1));
    }
    return volts;
  }

  PlantName name_;
  std::filesystem::path bench_;
  std::unique_ptr<Process> plant_;

 private:
  int launched_ = 0;
};

TEST_F(DaemonAndPlant, AKilledDaemonsGuardianMakesTheReferenceSafe) {
  const auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  run(*daemon);
  ASSERT_EQ(reference(), 3);
  emtbd->signal(SIGKILL);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_TRUE(eventually([this] { return reference() == 0; }, 5));
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  RecordProperty("milliseconds", static_cast<int>(took.count() * 1e3));
  EXPECT_TRUE(eventually([&] { return emtbd->err().find("emtbd is gone without a word") != std::string::npos; }));
}

TEST_F(DaemonAndPlant, WhoeverKillsTheGuardianLatchesTheDaemonWhichStartsAnother) {
  const auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  run(*daemon);
  const int first = guardian_of(*emtbd);
  ASSERT_GT(first, 0);
  kill(first, SIGKILL);
  EXPECT_TRUE(eventually([this] { return reference() == 0; }, 5));
  EXPECT_TRUE(eventually([&] { return daemon->call("status", {})["fault"]["code"] == 702; }));
  EXPECT_TRUE(eventually([&] { return guardian_of(*emtbd) > 0 && guardian_of(*emtbd) != first; }));
  run(*daemon);  // a person may go on
  emtbd->signal(SIGTERM);
  EXPECT_EQ(emtbd->wait(), 0) << "and an orderly end is none of the guardian's business";
  EXPECT_EQ(emtbd->err().find("MAY NOT BE SAFE"), std::string::npos) << emtbd->err();
}

TEST_F(DaemonAndPlant, ADaemonThatIsStoppedIsEndedByItsGuardian) {
  const auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  run(*daemon);
  emtbd->signal(SIGSTOP);
  EXPECT_TRUE(eventually([this] { return reference() == 0; }));
  EXPECT_EQ(emtbd->wait(), 128 + SIGKILL);
  // The guardian says so once it has let go of the devices, thus later than the plant sees it.
  EXPECT_TRUE(eventually([&] { return emtbd->err().find("emtbd stands still and was ended") != std::string::npos; }))
      << emtbd->err();
}

TEST_F(DaemonAndPlant, ATerminalStopsNoDaemon) {
  const auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  run(*daemon);
  for (const int signal : {SIGTSTP, SIGTTOU, SIGTTIN}) emtbd->signal(signal);
  EXPECT_EQ(daemon->call("status", {})["state"], "running");
}

TEST_F(DaemonAndPlant, ALogThatNobodyReadsKeepsItFromNothing) {
  const std::string log = path("fifo").string();
  ASSERT_EQ(mkfifo(log.c_str(), 0600), 0);
  const int ours = open(log.c_str(), O_RDWR | O_NONBLOCK | O_CLOEXEC);
  std::string command = "exec";
  for (const std::string& word : emtbd_words(bench_, path(""))) command += " '" + word + "'";
  Process emtbd({"/bin/sh", "-c", command + " 2>'" + log + "'"}, path("d"));
  auto daemon = client(emtbd);
  ASSERT_TRUE(daemon);
  run(*daemon);
  const std::string much(4096, 'x');
  while (::write(ours, much.data(), much.size()) > 0) {
  }
  emtbd.signal(SIGTERM);
  EXPECT_TRUE(eventually([this] { return reference() == 0; }));
  EXPECT_EQ(emtbd.wait(), 0);
  close(ours);
}

TEST_F(DaemonAndPlant, WhereBothAreGoneTheReferenceStaysAndSafeMakesItSafe) {
  for (const std::vector<std::string>& program :
       {std::vector<std::string>{EMTBD, "--config", bench_, "--safe"}, {EMTB_SAFE, "--config", bench_}}) {
    auto emtbd = launch();
    auto daemon = client(*emtbd);
    ASSERT_TRUE(daemon) << emtbd->err();
    run(*daemon);
    ASSERT_TRUE(kill_with_guardian(*emtbd));
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    EXPECT_EQ(reference(), 3) << "this is why there is ExecStopPost";
    Process safe(program, path("safe"));
    EXPECT_EQ(safe.wait(), 0) << safe.err();
    EXPECT_TRUE(eventually([this] { return reference() == 0; }, 5)) << program[0];
  }
}

class EmtbSafe : public Scratch {};

/// What takes the time of a start is the libraries: HDF5 alone brings forty.
TEST_F(EmtbSafe, LoadsNothingOfTheRecorder) {
  std::ifstream file(EMTB_SAFE, std::ios::binary);
  const std::string program{std::istreambuf_iterator<char>(file), {}};
  EXPECT_NE(program.find("libyaml-cpp"), std::string::npos)
      << "the names of libraries stand in the program as they are";
  for (const char* library : {"libhdf5", "libmatio", "libspdlog"}) {
    EXPECT_EQ(program.find(library), std::string::npos) << library;
  }
}

TEST_F(EmtbSafe, SaysInOneLineWhatIsWrong) {
  Process none({EMTB_SAFE, "--config", path("none.yaml")}, path("1"));
  EXPECT_EQ(none.wait(), 2);
  EXPECT_THAT(none.err(), testing::StartsWith("emtb-safe: " + path("none.yaml").string() + ": cannot be read"));
  EXPECT_EQ(std::ranges::count(none.err(), '\n'), 1) << none.err();
  Process bad({EMTB_SAFE, "--fast"}, path("2"));
  EXPECT_EQ(bad.wait(), 2);
}

TEST_F(DaemonAndPlant, ARestartAloneMakesItSafe) {
  {
    const auto emtbd = launch();
    auto daemon = client(*emtbd);
    ASSERT_TRUE(daemon) << emtbd->err();
    run(*daemon);
    ASSERT_TRUE(kill_with_guardian(*emtbd));
  }
  const auto emtbd = launch();
  ASSERT_TRUE(client(*emtbd)) << emtbd->err();
  EXPECT_TRUE(eventually([this] { return reference() == 0; }, 5));
}

TEST_F(DaemonAndPlant, APlantThatDiesEndsTheRunAndTheSessionTellsSo) {
  const auto emtbd = launch();
  auto daemon = client(*emtbd);
  ASSERT_TRUE(daemon) << emtbd->err();
  const std::string file = run(*daemon);
  plant_->signal(SIGKILL);
  ASSERT_TRUE(eventually([&] { return daemon->call("status", {})["run"].is_null(); }));
  EXPECT_EQ(daemon->call("status", {})["state"], "latched");
  EXPECT_EQ(read_session(file).complete, true);
  EXPECT_THROW(daemon->call("reset", {}), rpc::Refusal);
  EXPECT_TRUE(eventually([&] {  // a plant counts as alive for a second
    Process safe({EMTBD, "--config", bench_, "--safe"}, path("safe"));
    return safe.wait() == 1 && safe.err().find("THE REFERENCE MAY NOT BE SAFE") != std::string::npos;
  })) << "nobody is there to be made safe, and it must say so";
}

}  // namespace
}  // namespace emtb
