#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/process.h"
#include "tests/server/page_browser.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::HasSubstr;

/// `emtb page` on recordings of the simulated bench, with work kept in a folder of the test's own.
class PageCommand : public Scratch {
 protected:
  PageCommand() {
    setenv("XDG_STATE_HOME", path("state").c_str(), 1);
    model_ = write("work/model.yaml", read(std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml"));
    record("step_low", "fh2_step_low");
    record("step_mid", "fh2_step_mid");
  }
  ~PageCommand() override { unsetenv("XDG_STATE_HOME"); }

  /// A motor with dry friction, which the model lacks, as the model itself simulates it.
  void record(const std::string& name, const std::string& profile) {
    record_with(dry_friction + ": {T_c: {value: 0.05, min: 0, max: 1, unit: N m}}", name, profile);
  }

  /// A motor with an effect, as it stands in a model's file.
  void record_with(const std::string& effect, const std::string& name, const std::string& profile) {
    std::string text = read(std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml");
    const std::string none = "effects: {}";
    text.replace(text.find(none), none.size(), "effects:\n  " + effect);
    const auto truth = write("truth.yaml", text);
    Process simulate({EMTB, "simulate", truth, profile, "--rate", "200", "--out", path("work/" + name + ".csv")},
                     path("simulate"));
    EXPECT_EQ(simulate.wait(), 0) << simulate.err();
  }

  void start() { start_with({path("work/step_low.csv")}, {path("work/step_mid.csv")}); }

  void start_with(const std::vector<std::string>& train, const std::vector<std::string>& held_out) {
    std::vector<std::string> words{EMTB, "page", model_};
    words.insert(words.end(), train.begin(), train.end());
    words.emplace_back("--held-out");
    words.insert(words.end(), held_out.begin(), held_out.end());
    words.insert(words.end(), {"--port", "0"});
    page_ = std::make_unique<Process>(words, path("page"));
    std::smatch found;
    std::string said;
    EXPECT_TRUE(eventually([&] {
      said = page_->out();
      return std::regex_search(said, found, std::regex(":(\\d+)/#token=([0-9a-f]{32})\n"));
    })) << page_->err();
    port_ = static_cast<std::uint16_t>(std::stoi(found[1]));
    token_ = found[2];
  }

  std::unique_ptr<Browser> open() {
    auto browser = std::make_unique<Browser>(port_);
    const json welcome = browser->ask("hello", {{"token", token_}, {"protocol", 1}});
    EXPECT_EQ(welcome["result"]["files"], true) << welcome;
    return browser;
  }

  json result(Browser& browser, const std::string& method, const json& params = json::object()) {
    json answer = browser.ask(method, params);
    EXPECT_TRUE(answer.contains("result")) << method << ": " << answer;
    return answer["result"];
  }

  /// The only effect whose name this test must know.
  const std::string dry_friction = "coulomb_friction";
  std::filesystem::path model_;
  std::unique_ptr<Process> page_;
  std::uint16_t port_ = 0;
  std::string token_;
};

TEST_F(PageCommand, TheErrorFallsAsTheEffectIsAddedAndRisesWithUndo) {
  start();
  const auto page = open();
  const std::string given = read(model_);
  const double first = result(*page, "work")["error"]["held_out"];
  const double fitted = result(*page, "fit")["error"]["held_out"];
  EXPECT_LT(fitted, first);
  const json with = result(*page, "add", {{"effect", dry_friction}});
  EXPECT_LT(with["error"]["held_out"].get<double>(), 0.5 * fitted);
  EXPECT_EQ(with["steps"].back()["added"], dry_friction);
  EXPECT_EQ(with["undo"], "add " + dry_friction);
  const json undone = result(*page, "undo");
  EXPECT_NEAR(undone["error"]["held_out"].get<double>(), fitted, 0.01 * fitted);
  EXPECT_EQ(undone["redo"], "add " + dry_friction);
  EXPECT_TRUE(undone["effects"].empty());
  EXPECT_FALSE(result(*page, "redo")["effects"].empty());
  EXPECT_EQ(read(model_), given) << "a MODEL is never overwritten";
}

TEST_F(PageCommand, ADragAnswersWithItsNumberAndChangesNothing) {
  start();
  const auto page = open();
  const json before = result(*page, "work");
  const json answer =
      result(*page, "simulate", {{"seq", 41}, {"run", "0"}, {"points", 100}, {"parameters", {{"R_a", 60}}}});
  EXPECT_EQ(answer["seq"], 41);
  const json& omega = answer["signals"]["omega"];
  EXPECT_LE(omega["t"].size(), 101u);
  EXPECT_EQ(omega["t"].size(), omega["simulated"].size());
  EXPECT_EQ(omega["t"].size(), omega["measured"]["min"].size());
  EXPECT_EQ(omega["t"].size(), omega["residual"]["mean"].size());
  const json lean =
      result(*page, "simulate", {{"seq", 42}, {"run", "0"}, {"measured", false}, {"parameters", json::object()}});
  EXPECT_FALSE(lean["signals"]["omega"].contains("measured"));
  EXPECT_NE(lean["error"], answer["error"]);
  EXPECT_EQ(result(*page, "work"), before);
  EXPECT_THAT(page->ask("simulate", {{"run", "0"}, {"parameters", {{"nonsense", 1}}}})["error"]["message"],
              HasSubstr("nonsense"));
}

TEST_F(PageCommand, ARestartAndADeadWorkerLoseNothing) {
  start();
  auto page = open();
  result(*page, "set", {{"parameters", {{"R_a", 40}}}});
  const json kept = result(*page, "lock", {{"parameter", "J"}, {"fixed", true}});
  page_->signal(SIGTERM);
  EXPECT_EQ(page_->wait(), 0);
  start();
  page = open();
  const json again = result(*page, "work");
  EXPECT_EQ(again["parameters"], kept["parameters"]);
  EXPECT_EQ(again["undo"], kept["undo"]);
  int worker = 0;
  std::ifstream children("/proc/" + std::to_string(page_->pid()) + "/task/" + std::to_string(page_->pid()) +
                         "/children");
  ASSERT_TRUE(children >> worker);
  kill(worker, SIGKILL);
  const json told = page->notification("worker_died");
  EXPECT_THAT(told["params"]["text"], HasSubstr("signal 9"));
  EXPECT_EQ(result(*page, "work")["parameters"], kept["parameters"]);
  EXPECT_EQ(result(*page, "undo")["parameters"]["J"]["fixed"], false);
}

TEST_F(PageCommand, DiagnosesReportsAndIsCancelled) {
  start();
  const auto page = open();
  const json found = result(*page, "diagnose");
  EXPECT_EQ(found["missing"][0]["id"], dry_friction) << found["verdict_text"];
  EXPECT_FALSE(found["candidates"][0]["signature"]["effect"].empty());
  EXPECT_FALSE(found["candidates"][0]["what"].get<std::string>().empty());
  EXPECT_EQ(page->notification("progress")["params"]["what"], "diagnose");
  EXPECT_THAT(result(*page, "report")["html"].get<std::string>(), HasSubstr("<html"));
  result(*page, "set", {{"parameters", {{"R_a", 40}}}});
  page->send(R"({"jsonrpc":"2.0","id":"long","method":"diagnose"})");
  const json cancelled = page->ask("cancel");
  EXPECT_EQ(cancelled["result"]["cancelled"], "diagnose");
  EXPECT_EQ(result(*page, "work")["parameters"]["R_a"]["value"], 40);
}

TEST_F(PageCommand, ADiagnosisLeavesTheFittedModelAndItsFloorsWithUndo) {
  start();
  auto page = open();
  const json given = result(*page, "work");
  const json found = result(*page, "diagnose");
  const auto other = open();
  for (const json& work : {found["work"], result(*page, "work"), result(*other, "work")}) {
    const double base = found["error"]["base"]["held_out"];
    EXPECT_NEAR(work["error"]["held_out"].get<double>(), base, 1e-3 * base);
    EXPECT_EQ(work["undo"], "fit");
    for (const json& signal : work["signals"]) {
      const double sigma = found["signals"][signal["name"].get<std::string>()]["sigma"];
      EXPECT_NEAR(signal["floor"].get<double>(), sigma, 1e-6 * sigma) << signal["name"];
    }
  }
  page_->signal(SIGTERM);
  EXPECT_EQ(page_->wait(), 0);
  start();
  page = open();
  EXPECT_EQ(result(*page, "work")["signals"], found["work"]["signals"]);
  const double before = given["error"]["train"];
  EXPECT_NEAR(result(*page, "undo")["error"]["train"].get<double>(), before, 1e-3 * before);
}

TEST_F(PageCommand, MakesSessionsOfPartsAndOfForeignColumns) {
  start();
  const auto page = open();
  const json low = result(*page, "sessions")["sessions"][0];
  EXPECT_EQ(low["picture"]["signal"], "omega");
  EXPECT_GT(low["picture"]["t"].size(), 20u);
  const std::string recording = low["path"], before = read(recording);
  const json part = result(*page, "session_cut", {{"path", recording}, {"from", 2}, {"to", 5.5}});
  EXPECT_EQ(part["name"], "step_low_2-5.5s.h5");
  EXPECT_NEAR(result(*page, "session_data", {{"path", part["path"]}})["runs"][0]["duration"].get<double>(), 3.5, 0.01);
  EXPECT_EQ(result(*page, "session_cut", {{"path", recording}, {"from", 2}, {"to", 5.5}})["name"],
            "step_low_2-5.5s-2.h5")
      << "nothing is overwritten";
  EXPECT_EQ(read(recording), before);
  EXPECT_TRUE(page->ask("session_cut", {{"path", recording}, {"from", 1e6}}).contains("error"));
  EXPECT_TRUE(page->ask("session_cut", {{"path", "/etc/passwd"}, {"from", 1}}).contains("error"));

  const std::string two = write("work/two.csv", "run,t_s,omega_rad_s\na,0,1\na,1,2\nb,0,3\nb,1,4\nb,2,5\n");
  const json runs = result(*page, "session_data", {{"path", two}})["runs"];
  ASSERT_EQ(runs.size(), 2u);
  EXPECT_EQ(runs[1]["run"], "b");
  const json of_b = result(*page, "session_cut", {{"path", two}, {"run", "b"}, {"from", 1}});
  EXPECT_EQ(result(*page, "session_data", {{"path", of_b["path"]}})["runs"][0]["signals"]["omega"]["value"],
            json({4, 5}));
  EXPECT_TRUE(page->ask("session_cut", {{"path", two}, {"run", "c"}, {"from", 1}}).contains("error"));

  const std::string foreign = write("work/bench.csv", "zeit;n\n0;0\n500;60\n1000;120\n");
  const json columns = result(*page, "csv_columns", {{"path", foreign}})["columns"];
  EXPECT_EQ(columns[1],
            (json{{"name", "n"}, {"cells", {"0", "60", "120"}}, {"time", false}, {"signal", nullptr}, {"unit", ""}}));
  const std::string map = "time: zeit\ntime_unit: ms\ncolumns:\n  omega: {from: n, unit: rpm}\n";
  const json read_so = result(*page, "csv_map", {{"path", foreign}, {"map", map}});
  const json omega = result(*page, "session_data", {{"path", read_so["path"]}})["runs"][0]["signals"]["omega"];
  EXPECT_EQ(omega["t"], json({0, 0.5, 1}));
  EXPECT_NEAR(omega["value"][2].get<double>(), 4 * M_PI, 1e-5);
  EXPECT_EQ(read(foreign), "zeit;n\n0;0\n500;60\n1000;120\n") << "a recording stays where it is";
  EXPECT_THAT(page->ask("csv_map", {{"path", foreign}, {"map", "time: nowhere"}})["error"]["message"],
              HasSubstr("nowhere"));
}

TEST_F(PageCommand, ALawForWhatTheLibraryLacksIsDrawnAndAdded) {
  const std::string hump =
      "hump: {torque: \"-a*tanh(omega/2)*exp(-((abs(omega) - 70)/15)^2)\", parameters: "
      "{a: {value: 0.05, min: 0, max: 1, unit: N m}}}";
  for (const char* name : {"ramp", "random", "step_mid", "step_low"}) {
    record_with(hump, name, std::string("fh2_") + name);
  }
  start_with({path("work/ramp.csv"), path("work/random.csv")}, {path("work/step_mid.csv"), path("work/step_low.csv")});
  const auto page = open();
  const json found = result(*page, "diagnose");
  ASSERT_EQ(found["verdict"], "unknown_effect") << found["verdict_text"];
  const json& law = found["discovered"]["law"];
  ASSERT_TRUE(law.is_object()) << found["discovered"]["no_law"];
  EXPECT_EQ(law["of"][0], "omega");
  EXPECT_EQ(law["curve"]["at"].size(), law["curve"]["value"].size());
  EXPECT_NEAR(law["parameters"]["c"]["value"].get<double>(), 70, 1) << law["formula"];
  const double before = result(*page, "work")["error"]["held_out"].get<double>();
  EXPECT_NEAR(law["error"]["before"]["held_out"].get<double>(), before, 1e-3 * before);
  EXPECT_NEAR(found["error"]["final"]["held_out"].get<double>(), before, 1e-3 * before);
  const json with = result(*page, "add", {{"formula", law["add"]}});
  EXPECT_EQ(with["effects"][0]["id"], law["id"]);
  EXPECT_LT(with["error"]["held_out"].get<double>(), 0.1 * before);
}

TEST_F(PageCommand, ScoresAndAddsAFormula) {
  start();
  const auto page = open();
  result(*page, "fit");
  const json formula{
      {"id", "mine"},
      {"place", "torque"},
      {"formula", "-T*tanh(omega/w)"},
      {"parameters",
       {{"T", {{"value", 0}, {"min", 0}, {"max", 1}}}, {"w", {{"value", 5}, {"min", 0.5}, {"max", 50}}}}}};
  const json scored = result(*page, "formula", formula);
  EXPECT_LT(scored["train"]["after"].get<double>(), scored["train"]["before"].get<double>());
  EXPECT_EQ(result(*page, "add", {{"formula", formula}})["effects"][0]["id"], "mine");
  EXPECT_TRUE(result(*page, "remove", {{"effect", "mine"}})["effects"].empty());
  json wrong = formula;
  wrong["formula"] = "system(1";
  EXPECT_TRUE(page->ask("formula", wrong).contains("error"));

  json late = formula;  // it may remember
  late["id"] = "late";
  late["formula"] = "-T*z";
  late["memory"] = {{"z", "(tanh(omega/w) - z)/0.1"}};
  EXPECT_TRUE(result(*page, "formula", late).contains("train"));
  late["memory"] = {{"z", "(tanh(speed/w) - z)/0.1"}};
  EXPECT_TRUE(page->ask("formula", late).contains("error"));
}

TEST_F(PageCommand, ReadsTheFoldersThatWereNamedAndNoOther) {
  start();
  const auto page = open();
  const json sessions = result(*page, "sessions")["sessions"];
  ASSERT_EQ(sessions.size(), 2u) << sessions;
  const std::string low = sessions[0]["path"];
  EXPECT_EQ(sessions[0]["used"], "train");
  EXPECT_EQ(sessions[1]["used"], "held_out");
  const std::string foreign = write("elsewhere/secret.csv", "t_s,omega_rad_s\n0,1\n1,2\n");
  for (const std::string& outside :
       {foreign, path("work/../elsewhere/secret.csv").string(), std::string("/etc/passwd")}) {
    EXPECT_THAT(page->ask("session_data", {{"path", outside}})["error"]["message"], HasSubstr("no recording"))
        << outside;
    EXPECT_TRUE(page->ask("session_use", {{"path", outside}, {"as", "train"}}).contains("error"));
  }
  const std::string note = "<img src=x onerror=alert(1)>";
  result(*page, "session_note", {{"path", low}, {"note", note}, {"tags", {"cold"}}});
  EXPECT_EQ(result(*page, "sessions")["sessions"][0]["note"], note);
  EXPECT_EQ(result(*page, "sessions")["sessions"][0]["tags"], json({"cold"}));
  EXPECT_FALSE(
      result(*page, "session_data", {{"path", low}, {"points", 50}})["runs"][0]["signals"]["omega"]["t"].empty());
  EXPECT_THAT(page->ask("status")["error"]["message"], HasSubstr("no daemon"));
}

TEST_F(PageCommand, OtherPagesAreToldOfAChange) {
  start();
  const auto one = open(), two = open();
  result(*one, "set", {{"parameters", {{"R_a", 40}}}});
  EXPECT_EQ(two->notification("work")["params"]["parameters"]["R_a"]["value"], 40);
}

TEST_F(PageCommand, SaysWhatIsWrongWithItsFiles) {
  Process none({EMTB, "page", model_}, path("page"));
  EXPECT_EQ(none.wait(), 2);
  EXPECT_THAT(none.err(), HasSubstr("SESSION"));
  Process gone({EMTB, "page", path("nowhere.yaml"), path("work/step_low.csv")}, path("page"));
  EXPECT_EQ(gone.wait(), 2);
  EXPECT_THAT(gone.err(), HasSubstr("nowhere.yaml"));
}

}  // namespace
}  // namespace emtb
