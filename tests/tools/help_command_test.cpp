#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::AllOf;
using testing::Each;
using testing::HasSubstr;
using testing::Not;
using testing::SizeIs;

/// What `emtb` says about itself.
class HelpCommand : public CommandCaller {
 protected:
  static std::vector<std::string> lines_of(const std::string& text) {
    std::vector<std::string> lines;
    std::istringstream in(text);
    for (std::string line; std::getline(in, line);) lines.push_back(line);
    return lines;
  }

  /// Bad use: exit 2 and one line.
  std::string complaint(const std::vector<std::string>& words) {
    EXPECT_EQ(call(words), 2);
    EXPECT_EQ(last->out(), "");
    EXPECT_EQ(std::ranges::count(last->err(), '\n'), 1) << last->err();
    return last->err();
  }
};

TEST_F(HelpCommand, AnAnswerThatADiskHasNoRoomForIsNoSuccess) {
  Process full({"/bin/sh", "-c", std::string(EMTB) + " effects >/dev/full"}, path("full"));
  EXPECT_EQ(full.wait(), 2);
  EXPECT_THAT(full.err(), HasSubstr("standard output takes no more"));
}

TEST_F(HelpCommand, ShowsEveryCommandOfTheSourceInAGroup) {
  ASSERT_EQ(call({"--help"}), 0);
  const std::string help = last->out();
  std::size_t commands = 0;
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(EMTB_SOURCE_DIR) / "tools")) {
    if (file.path().extension() != ".cpp") continue;
    const std::string text = read(file.path());
    for (std::size_t at = text.find("line.command("); at != std::string::npos;
         at = text.find("line.command(", at + 1)) {
      const std::size_t from = text.find('"', at) + 1;
      const std::string name = text.substr(from, text.find('"', from) - from);
      EXPECT_THAT(help, HasSubstr("\n  " + name + " ")) << "emtb.cpp puts it into no group";
      ++commands;
    }
  }
  EXPECT_GT(commands, 20U);
  EXPECT_THAT(help, AllOf(HasSubstr("\nRecorded sessions:\n"), HasSubstr("\nThe model itself:\n")));
}

TEST_F(HelpCommand, FitsEightyColumnsWhereItIsPiped) {
  for (const auto& words :
       std::vector<std::vector<std::string>>{{"--help"}, {"help", "diagnose"}, {"run", "--help"}, {"profiles"}}) {
    ASSERT_EQ(call(words), 0) << last->err();
    EXPECT_THAT(lines_of(last->out()), Each(SizeIs(testing::Le(80U)))) << words[0];
  }
}

TEST_F(HelpCommand, HelpExplainsOneCommandAsItsOwnOptionDoes) {
  ASSERT_EQ(call({"help", "compare"}), 0);
  const std::string by_name = last->out();
  EXPECT_THAT(by_name, AllOf(HasSubstr("Usage: emtb compare"), HasSubstr("--plot")));
  ASSERT_EQ(call({"help"}), 0);
  const std::string all = last->out();
  ASSERT_EQ(call({"--help"}), 0);
  EXPECT_EQ(all, last->out());
}

TEST_F(HelpCommand, AMistypedWordIsAnsweredWithTheNearestOne) {
  EXPECT_EQ(complaint({"diagnos"}), "emtb: diagnos: no such command; did you mean diagnose?\n");
  EXPECT_EQ(complaint({"help", "reprot"}), "emtb: reprot: no such command; did you mean report?\n");
  EXPECT_THAT(complaint({"frobnicate"}), AllOf(HasSubstr("no such command"), Not(HasSubstr("did you mean"))));
  EXPECT_THAT(complaint({"check", "a.csv", "--jsn"}), HasSubstr("--jsn: no such option; did you mean --json?"));
  EXPECT_THAT(complaint({}), HasSubstr("which command?"));
  EXPECT_THAT(complaint({"diagnose"}), HasSubstr("See emtb help diagnose"));
}

TEST_F(HelpCommand, AMistypedEffectIsAnsweredWithTheNearestOneWhereverItIsNamed) {
  const std::string model = std::string(EMTB_CONFIG) + "/models/fh2.yaml";
  const std::string guess = "emtb: unknown effect `coulomb`; did you mean coulomb_friction?\n";
  EXPECT_EQ(complaint({"effects", "coulomb"}), guess);
  EXPECT_EQ(complaint({"add", "coulomb", model, "none.csv"}), guess);
  for (const char* option : {"--without", "--only"}) {
    EXPECT_EQ(complaint({"diagnose", model, "none.csv", option, "coulomb"}), guess) << option;
    EXPECT_EQ(complaint({"report", model, "none.csv", "--out", path("r.html"), option, "coulomb"}), guess) << option;
  }
}

TEST_F(HelpCommand, AWordOfWhichThereAreButAFewIsNamedWhereItIsMissingOrAnother) {
  EXPECT_EQ(complaint({"bench"}), "emtb: bench: which? check, calibrate or spin. See emtb help bench\n");
  EXPECT_EQ(complaint({"config"}), "emtb: config: which? check, upgrade or schema. See emtb help config\n");
  EXPECT_EQ(complaint({"bench", "chek"}), "emtb: bench chek: not known; did you mean check?\n");
  EXPECT_EQ(complaint({"config", "mend"}), "emtb: config mend: not known. Known: check, upgrade, schema\n");
}

TEST_F(HelpCommand, TheUnitOfAPureNumberIsForProgramsAlone) {
  const std::string warmup = "friction_warmup";
  ASSERT_EQ(call({"effects"}), 0);
  EXPECT_THAT(last->out(), AllOf(HasSubstr(" drop, tau [s]"), Not(HasSubstr("[1]"))));
  ASSERT_EQ(call({"effects", warmup}), 0);
  EXPECT_THAT(last->out(), HasSubstr("    drop, absent at 0, from -1 to"));
  ASSERT_EQ(call({"effects", warmup, "--json", "-"}), 0);
  EXPECT_EQ(json::parse(last->out())["parameters"][0]["unit"], "1");
}

TEST_F(HelpCommand, TheVersionNamesTheCommit) {
  ASSERT_EQ(call({"--version"}), 0);
  EXPECT_THAT(last->out(), testing::MatchesRegex("emtb [0-9.]+ \\(commit [0-9a-f]+(-dirty)?\\)\n"));
}

TEST_F(HelpCommand, ProfilesAreListedWithWhatTheyAreForAndShown) {
  ASSERT_EQ(call({"profiles", "--json", path("p.json")}), 0) << last->err();
  const json all = json::parse(read(path("p.json")))["profiles"];
  std::size_t files = 0;
  for (const auto& file : std::filesystem::directory_iterator(std::filesystem::path(EMTB_CONFIG) / "profiles")) {
    if (file.path().extension() == ".yaml") ++files;
  }
  EXPECT_EQ(all.size(), files);
  for (const json& p : all) {
    EXPECT_GT(p["about"].get<std::string>().size(), 20U) << p["name"];
    EXPECT_GT(p["duration_s"].get<double>(), 0) << p["name"];
    EXPECT_THAT(last->out(), HasSubstr(p["name"].get<std::string>() + "  (" + p["kind"].get<std::string>()));
  }
  ASSERT_EQ(call({"profiles", "fh2_step_mid"}), 0);
  EXPECT_THAT(last->out(), AllOf(HasSubstr("22 s, 0 to 4 V"), HasSubstr("level: 4")));
  ASSERT_EQ(call({"profiles", "fh2_step_mid", "--json", "-"}), 0);
  EXPECT_EQ(json::parse(last->out())["kind"], "step");
  EXPECT_THAT(complaint({"profiles", "fh2_absent"}), HasSubstr("no fh2_absent.yaml"));
}

}  // namespace
}  // namespace emtb
