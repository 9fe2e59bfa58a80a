#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "server/client.h"
#include "session/session.h"
#include "session/spec.h"
#include "tests/plant_bench.h"
#include "tests/process.h"
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
    return std::make_unique<Process>(
        std::vector<std::string>{EMTBD, "--config", bench_, "--socket", path("s"), "--data", path("data")},
        path("d" + std::to_string(++launched_)));
  }
  std::unique_ptr<Client> client() {
    std::unique_ptr<Client> found;
    eventually([&] {
      try {
        found = std::make_unique<Client>(path("s"));
        found->call("status", {});
        return true;
      } catch (const ProtocolError&) {
        return false;
      }
    });
    return found;
  }
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

TEST_F(DaemonAndPlant, AKilledDaemonLeavesTheReferenceWhereItWasAndSafeMakesItSafe) {
  const auto emtbd = launch();
  auto daemon = client();
  ASSERT_TRUE(daemon) << emtbd->err();
  const std::string session = run(*daemon);
  emtbd->signal(SIGKILL);
  emtbd->wait();
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  EXPECT_EQ(reference(), 3) << "this is why there is ExecStopPost";
  Process safe({EMTBD, "--config", bench_, "--safe"}, path("safe"));
  EXPECT_EQ(safe.wait(), 0) << safe.err();
  EXPECT_TRUE(eventually([this] { return reference() == 0; }, 5));
}

TEST_F(DaemonAndPlant, ARestartAloneMakesItSafe) {
  {
    const auto emtbd = launch();
    auto daemon = client();
    ASSERT_TRUE(daemon) << emtbd->err();
    run(*daemon);
    emtbd->signal(SIGKILL);
    emtbd->wait();
  }
  const auto emtbd = launch();
  ASSERT_TRUE(client()) << emtbd->err();
  EXPECT_TRUE(eventually([this] { return reference() == 0; }, 5));
}

TEST_F(DaemonAndPlant, APlantThatDiesEndsTheRunAndTheSessionTellsSo) {
  const auto emtbd = launch();
  auto daemon = client();
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
