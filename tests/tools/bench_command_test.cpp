#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/client.h"
#include "tests/process.h"
#include "tests/session/scratch.h"
#include "tests/tools/shipped_bench.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

/// `emtb bench` and `emtb latency` beside a real emtbd on the simulated FH2 bench, with one thing about it changed.
class BenchCommands : public Scratch {
 protected:
  std::string bench(const std::string& from = "", const std::string& to = "") const {
    return write("bench.yaml", fh2_simulated(from, to)).string();
  }
  int call(std::vector<std::string> words) {
    words.insert(words.begin(), {EMTB, "--socket", path("s").string()});
    last = std::make_unique<Process>(words, path("emtb" + std::to_string(++called_)));
    return last->wait(120);
  }
  void start(const std::string& file) {
    emtbd = std::make_unique<Process>(std::vector<std::string>{EMTBD, "--config", file, "--socket", path("s"), "--data",
                                                               path("data"), "--pace", "max"},
                                      path("emtbd"));
    EXPECT_TRUE(eventually([&] { return call({"status"}) == 0; })) << emtbd->err();
  }
  int spin(const std::string& file) {
    start(file);
    return call({"bench", "spin", "--reset", "--yes"});
  }

  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Process> last;

 private:
  int called_ = 0;
};

TEST_F(BenchCommands, SpinAsksBeforeItMovesTheMotor) {
  start(bench());
  EXPECT_EQ(call({"bench", "spin", "--reset"}), 2);
  EXPECT_THAT(last->out(), HasSubstr("the motor turns, at 0.5 V and at 1.0 V"));
  EXPECT_THAT(last->err(), HasSubstr("add --yes"));
}

TEST_F(BenchCommands, SpinPassesAHealthyBench) {
  EXPECT_EQ(spin(bench()), 0) << last->out() << last->err();
  EXPECT_THAT(last->out(), HasSubstr("u_ref 0.5 V:"));
  EXPECT_THAT(last->out(), HasSubstr("u_ref 1.0 V:"));
  EXPECT_THAT(last->out(), HasSubstr("Signs and scales agree"));
}

TEST_F(BenchCommands, SpinStopsAtTheFirstLevelAndNamesTheWire) {
  EXPECT_EQ(spin(bench("omega: {range: [-200, 200], noise: 0.2}", "omega: {range: [-200, 200], gain: -1}")), 1);
  EXPECT_THAT(last->out(), HasSubstr("WRONG: omega reads -"));
  EXPECT_THAT(last->out(), HasSubstr("its sign is wrong"));
  EXPECT_THAT(last->out(), Not(HasSubstr("u_ref 1.0 V:"))) << "nothing larger";
}

TEST_F(BenchCommands, LatencyJudgesThisComputerWithTheBenchsDevices) {
  const int answer = call(
      {"latency", "--config", bench("rate: 1000", "rate: 100"), "--seconds", "1", "--json", path("l.json").string()});
  EXPECT_TRUE(answer == 0 || answer == 1) << last->err();  // a busy machine may say no
  EXPECT_THAT(last->out(), HasSubstr("woke late by"));
  EXPECT_THAT(last->out(), HasSubstr("deadlines"));
  const json l = json::parse(read(path("l.json")));
  EXPECT_EQ(l["rate"], 100);
  EXPECT_GT(l["ticks"], 10);
  EXPECT_GE(l["late_us"]["p99"], l["late_us"]["p50"]);
  EXPECT_EQ(l["answer"] == "no", answer == 1);
}

TEST_F(BenchCommands, LatencySaysInOneLineWhyADaemonDoesNotStart) {
  EXPECT_EQ(call({"latency", "--config", path("none.yaml").string()}), 2);
  EXPECT_THAT(last->err(), HasSubstr("none.yaml: cannot be read"));
  EXPECT_EQ(call({"bench", "dance"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("Known: check, calibrate, spin"));
}

}  // namespace
}  // namespace emtb
