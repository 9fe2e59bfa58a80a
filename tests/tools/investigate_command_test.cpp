#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>

#include "server/client.h"
#include "tests/process.h"
#include "tests/session/scratch.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::ContainsRegex;
using testing::HasSubstr;

/// `emtb investigate` beside a real emtbd, whose simulated desk bench hides what the test says.
class Investigate : public Scratch {
 protected:
  /// Expressions in the bench's file, and what stands there instead.
  using Changes = std::vector<std::pair<std::string, std::string>>;

  /// @param hidden lines of the bench's `simulation:`
  void start(const std::string& hidden, const Changes& changes = {}) {
    emtbd_.reset();
    std::string desk = read(std::filesystem::path(EMTB_CONFIG) / "benches/desk-simulated.yaml");
    for (const auto& [from, to] : changes) desk = std::regex_replace(desk, std::regex(from), to);
    const auto bench = write("bench.yaml", desk + hidden);
    emtbd_ = std::make_unique<Process>(std::vector<std::string>{EMTBD, "--config", bench, "--socket", path("s"),
                                                                "--data", path("data"), "--pace", "max"},
                                       path("emtbd"));
    ASSERT_TRUE(eventually([&] { return call({"status"}) == 0; })) << emtbd_->err();
  }

  int call(std::vector<std::string> words) {
    words.insert(words.begin(), {EMTB, "--socket", path("s").string()});
    last_ = std::make_unique<Process>(words, path("emtb"));
    return last_->wait();
  }

  int investigate(std::vector<std::string> more) {
    more.insert(more.begin(), {"investigate", std::string(EMTB_CONFIG) + "/models/desk.yaml", "--settle", "1.5",
                               "--reset", "--out", path("found"), "--json", path("all.json")});
    return call(std::move(more));
  }
  /// A session of a step that is up to speed and never comes down again.
  std::string one_direction(const std::string& name, double level) {
    return recorded(name, "kind: step\nlevel: " + std::to_string(level) + "\nbefore: 0.5\nhold: 3\nafter: 0.5\n") +
           "@0:3.4";
  }
  std::string to_and_fro(const std::string& name, const std::string& levels) {
    return recorded(name, "kind: staircase\nlevels: [" + levels + "]\nbefore: 0.5\nhold: 1\nafter: 0.5\n");
  }
  /// A session of levels, from when it turns until it is stopped.
  std::string turning(const std::string& name, const std::string& levels) {
    return to_and_fro(name, levels) + "@1:4.4";
  }
  std::string recorded(const std::string& name, const std::string& profile) {
    EXPECT_EQ(call({"run", "--reset", write(name + ".yaml", "name: " + name + "\n" + profile).string()}), 0)
        << last_->err();
    return last_->out().substr(0, last_->out().find('\n'));
  }
  json all() { return json::parse(read(path("all.json"))); }

  std::unique_ptr<Process> emtbd_, last_;
};

TEST_F(Investigate, MakesTheFirstRunsSmallerWhereTheMotorWouldDrawMoreThanTheBenchAllows) {
  // 5.4 V and a gain of 4 on 0.85 ohm: 25 A, were the driver not as slow as it is; 19 end a run.
  start("  friction: {law: hard, T_c: 0.003}\n", {{"    R_a: 1.2 ", "    R_a: 0.85 "}});
  EXPECT_EQ(investigate({"--yes", "--no-confirm"}), 0) << last_->out() << last_->err();
  EXPECT_THAT(last_->out(), HasSubstr("step_high: -"));
  EXPECT_THAT(last_->out(), HasSubstr("near a limit of the bench"));
  EXPECT_EQ(all()["rounds"].back()["missing"][0]["id"], "coulomb_friction");
}

TEST_F(Investigate, FindsTheFrictionThatTheBenchHidesAndForetellsARun) {
  start("  friction: {law: hard, T_c: 0.003}\n");
  EXPECT_EQ(investigate({"--yes", "--report", path("page.html")}), 0) << last_->out() << last_->err();
  const std::string page = read(path("page.html"));
  EXPECT_THAT(page, HasSubstr("The model lacks Coulomb friction"));
  EXPECT_THAT(page, HasSubstr("Round by round"));
  EXPECT_THAT(page, HasSubstr("Foretold, then measured"));
  EXPECT_THAT(page, HasSubstr("investigate")) << "how it was called";
  const json found = all();
  EXPECT_EQ(found["diagnosis"]["verdict"], "found");
  ASSERT_EQ(found["rounds"].back()["missing"].size(), 1U) << last_->out();
  EXPECT_EQ(found["rounds"].back()["missing"][0]["id"], "coulomb_friction");
  EXPECT_EQ(found["sessions"].size(), 4U);
  EXPECT_EQ(found["held_out"].size(), 2U);
  EXPECT_LT(found["confirmed"]["final"]["chained_error"], 1.15);
  EXPECT_GT(found["confirmed"]["base"]["chained_error"], 2);
  EXPECT_TRUE(std::filesystem::is_regular_file(found["model"].get<std::string>()));
  EXPECT_TRUE(std::filesystem::is_regular_file(found["confirmed"]["prediction"].get<std::string>()));
  const std::string after = found["confirmed"]["session"];
  EXPECT_LT(std::filesystem::last_write_time(found["confirmed"]["prediction"].get<std::string>()),
            std::filesystem::last_write_time(after))
      << "it was said before";
}

TEST_F(Investigate, WritesWhatWasFoundAlsoWhereNoRunToConfirmItIsAllowed) {
  start("  friction: {law: hard, T_c: 0.003}\n");
  const std::string one = to_and_fro("one", "2, -2, 1, -1"), other = to_and_fro("other", "-1, 2, -2, 1");
  start("  friction: {law: hard, T_c: 0.003}\n", {{"omega: 620 ", "omega: 15 "}});  // a tenth needs 24 rad/s
  EXPECT_EQ(investigate({"--yes", "--sessions", one, "--held-out", other, "--report", path("page.html")}), 2)
      << last_->out();
  EXPECT_THAT(last_->err(), HasSubstr("near a limit of the bench"));
  const json found = all();
  EXPECT_EQ(found["diagnosis"]["missing"][0]["id"], "coulomb_friction");
  EXPECT_TRUE(found["confirmed"].is_null());
  EXPECT_THAT(read(found["model"].get<std::string>()), HasSubstr("T_c"));
  EXPECT_THAT(read(path("page.html")), HasSubstr("The model lacks Coulomb friction"));
}

TEST_F(Investigate, RecordsMoreWhereTheSessionsAtHandLeaveItOpen) {
  start("  friction: {law: hard, T_c: 0.003}\n");
  const std::string one = one_direction("one", 2), other = one_direction("other", 3);
  EXPECT_EQ(investigate({"--yes", "--no-confirm", "--sessions", one, "--held-out", other}), 0) << last_->out();
  const json found = all();
  ASSERT_EQ(found["rounds"].size(), 2U) << last_->out();
  EXPECT_EQ(found["rounds"][0]["verdict"], "unknown_effect") << "one level tells friction from B no more than a wish";
  EXPECT_THAT(
      last_->out(),
      ContainsRegex("(speed|current|terminal voltage|load torque) wrong by [0-9.]+ .*times the noise floor remains"));
  ASSERT_EQ(found["rounds"][1]["missing"].size(), 1U) << last_->out();
  EXPECT_EQ(found["rounds"][1]["missing"][0]["id"], "coulomb_friction");
}

TEST_F(Investigate, RunsTheProposedExperimentWhereEffectsTie) {
  start("  friction: {law: hard, T_c: 0.003}\n", {{"\n +torque: [^\n]*", ""}});
  const std::string one = turning("one", "2, 4, 1, 3"), other = turning("other", "3, 1, 4, 2");
  EXPECT_EQ(investigate({"--yes", "--no-confirm", "--rounds", "2", "--sessions", one, "--held-out", other}), 0)
      << last_->out() << last_->err();
  const json found = all();
  ASSERT_EQ(found["rounds"].size(), 2U) << last_->out() << last_->err();
  EXPECT_EQ(found["rounds"][0]["verdict"], "tied") << "one that turns one way tells friction from no load";
  ASSERT_EQ(found["sessions"].size(), 2U);
  EXPECT_THAT(found["sessions"][1].get<std::string>(), HasSubstr("-fit.h5")) << "no run at a limit of the bench";
  ASSERT_EQ(found["held_out"].size(), 2U);
  EXPECT_THAT(found["held_out"][1].get<std::string>(), HasSubstr("-judge.h5"));
  EXPECT_EQ(found["rounds"][1]["verdict"], "found");
  EXPECT_EQ(found["rounds"][1]["missing"][0]["id"], "coulomb_friction");
}

TEST_F(Investigate, MovesNothingWhereNobodyCanBeAsked) {
  start("");
  EXPECT_EQ(investigate({}), 2);
  EXPECT_THAT(last_->err(), HasSubstr("--yes"));
  EXPECT_FALSE(std::filesystem::exists(path("data")) && !std::filesystem::is_empty(path("data")));
}

TEST_F(Investigate, ArmsNothingWhereNobodyAgreed) {
  start("");
  EXPECT_EQ(investigate({"--reset"}), 2);
  EXPECT_EQ(call({"status"}), 0);
  EXPECT_THAT(last_->out(), HasSubstr("latched"));
}

TEST_F(Investigate, RefusesAPageThatItCouldNotWriteBeforeAnythingMoves) {
  start("");
  EXPECT_EQ(investigate({"--yes", "--report", path("no/such/page.html")}), 2);
  EXPECT_THAT(last_->err(), HasSubstr("no/such/page.html: cannot be written"));
  EXPECT_FALSE(std::filesystem::exists(path("data")) && !std::filesystem::is_empty(path("data")));
}

TEST_F(Investigate, HeldOutSessionsAloneAreRefused) {
  start("");
  EXPECT_EQ(investigate({"--held-out", "x.h5"}), 2);
  EXPECT_THAT(last_->err(), HasSubstr("--sessions"));
}

}  // namespace
}  // namespace emtb
