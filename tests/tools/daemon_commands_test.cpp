#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "server/client.h"
#include "session/spec.h"
#include "tests/process.h"
#include "tests/session/scratch.h"
#include "tests/tools/shipped_bench.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

const char* const brief = "name: brief\nkind: step\nlevel: 2\nbefore: 0.1\nhold: 0.5\nafter: 0.1\n";
const char* const endless = "name: endless\nkind: step\nlevel: 2\nbefore: 0\nhold: 100\nafter: 0\n";

/// `emtb` as a person calls it, beside a real emtbd on the simulated FH2 bench.
class DaemonCommands : public Scratch {
 protected:
  void start(const std::string& pace = "max") {
    const auto bench = write("bench.yaml", fh2_simulated());
    emtbd = std::make_unique<Process>(std::vector<std::string>{EMTBD, "--config", bench, "--socket", path("s"),
                                                               "--data", path("data"), "--pace", pace},
                                      path("emtbd"));
    ASSERT_TRUE(eventually([&] { return call({"status"}) == 0; })) << emtbd->err();
  }

  std::unique_ptr<Process> launch(std::vector<std::string> words) {
    words.insert(words.begin(), {EMTB, "--socket", path("s").string()});
    return std::make_unique<Process>(words, path("emtb" + std::to_string(++launched_)));
  }
  int call(std::vector<std::string> words) {
    last = launch(std::move(words));
    return last->wait();
  }
  json status() { return Client(path("s")).call("status", {}); }

  std::unique_ptr<Process> emtbd;
  std::unique_ptr<Process> last;

 private:
  int launched_ = 0;
};

TEST_F(DaemonCommands, ReplayNeedsNoDaemonAndFindsTheBenchInTheSession) {
  start();
  EXPECT_EQ(call({"run", "--reset", write("brief.yaml", brief)}), 0) << last->err();
  const std::string file = last->out().substr(0, last->out().find('\n'));
  emtbd.reset();
  EXPECT_EQ(call({"replay", file, "--data", path("again")}), 0) << last->err();
  const std::string again = last->out().substr(0, last->out().find('\n'));
  EXPECT_EQ(std::filesystem::path(again).parent_path(), path("again"));
  EXPECT_EQ(read_session(again).runs.at(0).at(Signal::omega).value,
            read_session(file).runs.at(0).at(Signal::omega).value);

  const auto strict =
      write("strict.yaml", std::regex_replace(read(path("bench.yaml")), std::regex("omega: 190"), "omega: 6"));
  EXPECT_EQ(call({"replay", file, "--config", strict, "--data", path("again")}), 1);
  EXPECT_THAT(last->err(), HasSubstr("over_speed"));
  EXPECT_EQ(call({"replay", path("none.h5"), "--config", strict}), 2);
  EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1) << last->err();
}

TEST_F(DaemonCommands, RunPrintsTheSessionsPathAndNothingElse) {
  start();
  EXPECT_EQ(call({"reset"}), 0) << last->err();
  EXPECT_EQ(call({"run", write("brief.yaml", brief), "--note", "n", "--json", path("end.json")}), 0) << last->err();
  std::string file = last->out();
  ASSERT_FALSE(file.empty());
  file.pop_back();
  EXPECT_TRUE(std::filesystem::is_regular_file(file)) << file;
  EXPECT_THAT(file, testing::EndsWith("-brief.h5"));
  EXPECT_EQ(last->err(), "") << "no progress bar into a pipe";
  EXPECT_EQ(json::parse(read(path("end.json")))["session"], file);
}

TEST_F(DaemonCommands, RunByNameFindsTheShippedProfiles) {
  start();
  EXPECT_EQ(call({"run", "--reset", "fh2_step_low"}), 0) << last->err();
  EXPECT_EQ(call({"run", "no_such_profile"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("no_such_profile"));
  EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1);
}

TEST_F(DaemonCommands, WhatIsNoRegularFileIsRefusedAtOnceWhereverAFileIsRead) {
  ASSERT_EQ(mkfifo(path("pipe.csv").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo(path("pipe.h5").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo(path("pipe.yaml").c_str(), 0600), 0);
  ASSERT_EQ(mkfifo(path("pipe.mat").c_str(), 0600), 0);
  const auto model = (std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml").string();
  const auto pipe = path("pipe.yaml").string();
  start();
  const std::vector<std::vector<std::string>> calls{{"run", pipe},
                                                    {"run", "/dev/zero"},
                                                    {"calibrate", pipe, path("pipe.csv")},
                                                    {"info", path("pipe.csv")},
                                                    {"info", path("pipe.h5")},
                                                    {"info", path("pipe.mat")},
                                                    {"compare", model, path("pipe.csv"), "--map", pipe},
                                                    {"simulate", model, pipe},
                                                    {"simulate", "/dev/zero", pipe}};
  for (const auto& words : calls) {
    EXPECT_EQ(call(words), 2) << words[0] << " " << words[1];
    EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1) << last->err();
  }
}

TEST_F(DaemonCommands, TimesInMillisecondsAreNoticedBeforeTheyTakeAllMemory) {
  std::string text = "t_s,u_ref_V,e_a_V,omega_rad_s\n";
  for (int k = 0; k < 3000; ++k) text += std::to_string(20 * k) + ",3,55," + std::to_string(70 + k % 2) + "\n";
  const auto model = (std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml").string();
  for (const char* command : {"compare", "calibrate"}) {
    EXPECT_EQ(call({command, model, write("ms.csv", text)}), 2);
    EXPECT_THAT(last->err(), HasSubstr("readings are 20 s apart"));
    EXPECT_THAT(last->err(), HasSubstr("time_unit: ms"));
  }
}

TEST_F(DaemonCommands, StopSaysWhetherARunWasOn) {
  start();
  EXPECT_EQ(call({"stop"}), 0);
  EXPECT_EQ(last->err(), "emtb: no run is on\n");
}

TEST_F(DaemonCommands, RunSaysWhatToDoWhileLatched) {
  start();
  EXPECT_EQ(call({"run", "fh2_step_low"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("`emtb reset`"));
  EXPECT_EQ(last->out(), "");
}

TEST_F(DaemonCommands, RepeatMakesSoManyRunsAndEachKeepsHowTheBrakeWasSet) {
  start();
  EXPECT_EQ(
      call({"run", "--reset", write("brief.yaml", brief), "--repeat", "3", "--brake", "1.2 A", "--operator", "N. N."}),
      0)
      << last->err();
  std::istringstream lines(last->out());
  std::set<std::string> files;
  for (std::string file; std::getline(lines, file);) {
    const Session session = read_session(file);
    EXPECT_EQ(session.attributes.at("brake"), "1.2 A");
    EXPECT_EQ(session.attributes.at("operator"), "N. N.");
    EXPECT_NEAR(session.runs.at(0).duration(), 0.7, 0.01);
    files.insert(file);
  }
  EXPECT_EQ(files.size(), 3U) << last->out();
  EXPECT_EQ(call({"run", "fh2_step_low", "--repeat", "0"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("--repeat: must be 1 or more"));
  EXPECT_EQ(status()["run"], nullptr);
}

TEST_F(DaemonCommands, RepeatEndsWithTheRunThatEndsEarly) {
  start("1");
  const auto run = launch({"run", "--reset", write("endless.yaml", endless), "--repeat", "3"});
  EXPECT_TRUE(eventually([&] { return status()["state"] == "running"; }));
  EXPECT_EQ(call({"stop"}), 0);
  EXPECT_EQ(run->wait(), 1);
  const std::string out = run->out();
  EXPECT_EQ(std::ranges::count(out, '\n'), 1) << "one session: " << out;
}

const char* const with_a_pause =
    "name: paused\nkind: step\nlevel: 2\nbefore: 0.1\nhold: 0.5\nafter: 0.1\n"
    "pauses: [{at: 0.3, say: set the brake to 2 A, within: 60}]\n";

TEST_F(DaemonCommands, ConfirmGoesOnWithARunThatWaits) {
  start("1");
  EXPECT_EQ(call({"confirm"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("no run waits for anybody"));
  const auto run = launch({"run", "--reset", write("paused.yaml", with_a_pause)});
  EXPECT_TRUE(eventually([&] { return run->err().find("set the brake to 2 A (within 60 s)") != std::string::npos; }));
  EXPECT_THAT(run->err(), HasSubstr("`emtb confirm`"));
  EXPECT_EQ(call({"status"}), 0);
  EXPECT_EQ(status()["run"]["pause"]["say"], "set the brake to 2 A");
  EXPECT_EQ(call({"confirm"}), 0) << last->err();
  EXPECT_EQ(run->wait(), 0) << run->err();
  const Session session = read_session(run->out().substr(0, run->out().find('\n')));
  std::vector<int> codes;
  for (const Event& event : session.events) codes.push_back(event.code);
  EXPECT_THAT(codes, testing::IsSupersetOf({event_code::paused, event_code::resumed}));
}

TEST_F(DaemonCommands, APauseThatNobodyConfirmsEndsTheRun) {
  start("max");
  EXPECT_EQ(call({"run", "--reset", write("paused.yaml", with_a_pause)}), 1);
  EXPECT_THAT(last->err(), HasSubstr("the run ended early: stopped"));
}

TEST_F(DaemonCommands, StopFromElsewhereEndsTheRunWithOne) {
  start("1");
  const auto run = launch({"run", "--reset", write("endless.yaml", endless)});
  EXPECT_TRUE(eventually([&] { return status()["state"] == "running"; }));
  EXPECT_EQ(call({"status"}), 0);
  EXPECT_THAT(last->out(), HasSubstr("run endless"));
  EXPECT_EQ(call({"run", "fh2_step_low"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("is on"));
  EXPECT_EQ(call({"stop"}), 0);
  EXPECT_EQ(run->wait(), 1);
  EXPECT_THAT(run->err(), HasSubstr("stopped"));
  EXPECT_THAT(run->out(), HasSubstr("-endless.h5"));
  EXPECT_EQ(status()["state"], "armed");
}

TEST_F(DaemonCommands, CtrlCStopsTheRun) {
  start("1");
  const auto run = launch({"run", "--reset", write("endless.yaml", endless)});
  EXPECT_TRUE(eventually([&] { return status()["state"] == "running"; }));
  run->signal(SIGINT);
  EXPECT_EQ(run->wait(), 1);
  EXPECT_THAT(run->err(), HasSubstr("stopped"));
  EXPECT_EQ(status()["state"], "armed");
}

TEST_F(DaemonCommands, AKilledRunCommandLatchesTheBench) {
  start("1");
  const auto run = launch({"run", "--reset", write("endless.yaml", endless)});
  EXPECT_TRUE(eventually([&] { return status()["state"] == "running"; }));
  run->signal(SIGKILL);
  EXPECT_TRUE(eventually([&] { return status()["fault"].is_object(); }));
  EXPECT_EQ(status()["fault"]["name"], "client_lost");
  EXPECT_EQ(call({"status"}), 0);
  EXPECT_THAT(last->out(), HasSubstr("client_lost"));
}

TEST_F(DaemonCommands, StatusAndWatchShowTheSignals) {
  start();
  EXPECT_TRUE(eventually([&] { return status()["signals"]["omega"]["value"].is_number(); }));
  EXPECT_EQ(call({"status", "--json", "-"}), 0);
  EXPECT_EQ(json::parse(last->out())["state"], "latched");
  const auto watch = launch({"watch", "--rate", "50"});
  EXPECT_TRUE(eventually([&] { return watch->out().find("omega") != std::string::npos; }));
  watch->signal(SIGINT);
  EXPECT_EQ(watch->wait(), 0);
  const auto plot = launch({"watch", "--rate", "20", "--plot"});
  EXPECT_TRUE(eventually([&] {
    const std::string out = plot->out();
    return out.find("ω [rad/s]") != std::string::npos && out.find("i_a [A]") != std::string::npos;
  }));
  plot->signal(SIGINT);
  EXPECT_EQ(plot->wait(), 0);
  EXPECT_THAT(plot->out(), Not(HasSubstr("\033"))) << "a pipe is no terminal";
  EXPECT_EQ(call({"estimates"}), 0) << last->err();
  EXPECT_THAT(last->out(), HasSubstr("R_a"))
      << "the model that the bench names is not beside this copy: the shipped one is";
}

TEST_F(DaemonCommands, EstimatesAreNearTheTruthAfterARun) {
  start();
  const std::string model = write("model.yaml", R"(
name: with friction
input: u_ref
driver: {gain: 18.3333333, rise: 22.5, fall: 20.4, min: 0, max: 110}
tie: {K_m: K_b}
parameters:
  R_a: {value: 30, min: 5, max: 100, unit: ohm}
  K_b: {value: 0.6, min: 0.1, max: 2, unit: V s/rad}
  B: {value: 3.0e-4, min: 0, max: 0.01, unit: N m s/rad}
  J: {value: 4.0e-3, min: 2.0e-4, max: 0.1, unit: kg m2}
effects:
  coulomb_friction: {T_c: {value: 0.02, min: 0, max: 1, unit: N m}}
)");
  EXPECT_EQ(call({"estimates", "--model", model}), 0) << last->err();
  EXPECT_THAT(last->out(), HasSubstr("not excited"));
  EXPECT_EQ(call({"run", "--reset", "fh2_staircase"}), 0) << last->err();
  json now;
  EXPECT_TRUE(eventually([&] {
    EXPECT_EQ(call({"estimates", "--json", "-"}), 0) << last->err();
    now = json::parse(last->out());
    return now["t"] > 55;
  })) << now;
  const std::map<std::string, double> truth{
      {"R_a", 31.825}, {"K_b", 0.6739}, {"J", 3.449e-3}, {"coulomb_friction.T_c", 0.0547}};
  for (const auto& [name, value] : truth) {
    const json& p = now["parameters"][name];
    EXPECT_NEAR(p["value"].get<double>(), value, 0.02 * value) << name << ": " << now;
    EXPECT_LT(p["std_error"].get<double>(), 0.02 * value) << name;
  }
  EXPECT_TRUE(now["innovation"].contains("omega"));
  EXPECT_TRUE(now["states"].contains("i_a"));
  const auto watch = launch({"estimates", "--watch", "--rate", "50"});
  EXPECT_TRUE(eventually([&] {
    const std::string out = watch->out();
    return std::ranges::count(out, '\n') > 40 && out.find("coulomb_friction.T_c") != std::string::npos;
  }));
  watch->signal(SIGINT);
  EXPECT_EQ(watch->wait(), 0);
}

TEST_F(DaemonCommands, BadUseIsOneLineAndTwo) {
  EXPECT_EQ(call({"status"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("no daemon answers"));
  EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1);
  for (const auto& words :
       std::vector<std::vector<std::string>>{{}, {"frobnicate"}, {"run"}, {"watch", "--rate", "x"}}) {
    EXPECT_EQ(call(words), 2);
    EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1) << last->err();
  }
  call({"frobnicate"});
  EXPECT_THAT(last->err(), HasSubstr("frobnicate: no such command"));
  EXPECT_EQ(call({"--help"}), 0);
  EXPECT_THAT(last->out(), HasSubstr("run"));
  EXPECT_EQ(call({"run", "--help"}), 0);
  EXPECT_THAT(last->out(), HasSubstr("PROFILE"));
}

}  // namespace
}  // namespace emtb
