#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "config/profile_list.h"
#include "model/catalogue.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::IsSupersetOf;
using testing::Not;
using testing::StartsWith;
using testing::UnorderedElementsAre;

using Offered = std::vector<std::string>;

std::vector<std::string> ids_of_all_effects() {
  std::vector<std::string> ids;
  for (const EffectInfo& e : effect_catalogue()) ids.emplace_back(e.id);
  return ids;
}

std::vector<std::string> names_of_all_profiles() {
  std::vector<std::string> names;
  for (const ListedProfile& p : shipped_profiles()) names.push_back(p.name);
  return names;
}

/// What a shell offers where somebody presses Tab behind some words, in a folder with the files mine.yaml and
/// run 1.csv.
class Completion : public CommandCaller {
 protected:
  Completion() {
    write("here/mine.yaml", "");
    write("here/run 1.csv", "");
    std::filesystem::create_directory(path("here/config"));
  }

  void write_completion(const std::string& shell) {
    ASSERT_EQ(call({"help", "--as", shell}), 0) << last->err();
    write("emtb." + shell, last->out());
  }

  /// @param words as they are typed, the last one as far as it is: `emtb bench `, `emtb diag`
  Offered in_bash(const std::string& words) {
    if (!std::filesystem::exists(path("emtb.bash"))) write_completion("bash");
    const std::string script = "cd " + path("here").string() + " && source ../emtb.bash && typed='" + words +
                               R"(' && read -ra COMP_WORDS <<<"$typed"
[[ $typed != *' ' ]] || COMP_WORDS+=('')
COMP_CWORD=$((${#COMP_WORDS[@]} - 1)) && _emtb && printf '%s\n' "${COMPREPLY[@]}")";
    Process bash({"/bin/bash", "-c", script}, path("bash"));
    EXPECT_EQ(bash.wait(), 0) << bash.err();
    EXPECT_EQ(bash.err(), "") << words;
    Offered offered;
    std::istringstream lines(bash.out());
    for (std::string line; std::getline(lines, line);) {
      if (!line.empty()) offered.push_back(line);
    }
    return offered;
  }
};

TEST_F(Completion, KnowsCommandsAndOptions) {
  EXPECT_THAT(in_bash("emtb diag"), ElementsAre("diagnose"));
  EXPECT_THAT(in_bash("emtb con"), UnorderedElementsAre("config", "confirm")) << "no folder of that name";
  EXPECT_THAT(in_bash("emtb --"), ElementsAre("--help", "--version", "--socket", "--no-cache"));
  EXPECT_THAT(in_bash("emtb diagnose --held"), ElementsAre("--held-out"));
  EXPECT_THAT(in_bash("emtb diagnose m.yaml s.csv --"),
              AllOf(IsSupersetOf({"--only", "--json"}), Not(Contains("--rate"))));
}

TEST_F(Completion, KnowsTheSecondWord) {
  EXPECT_THAT(in_bash("emtb bench "), ElementsAre("check", "calibrate", "spin"));
  EXPECT_THAT(in_bash("emtb bench c"), ElementsAre("check", "calibrate"));
  EXPECT_THAT(in_bash("emtb config u"), ElementsAre("upgrade"));
  EXPECT_THAT(in_bash("emtb help rep"), UnorderedElementsAre("report", "replay"));
  EXPECT_EQ(in_bash("emtb effects "), ids_of_all_effects());
  EXPECT_THAT(in_bash("emtb add wind"), ElementsAre("windage"));
  const Offered profiles = in_bash("emtb profiles "), at_run = in_bash("emtb run ");
  EXPECT_THAT(profiles, IsSupersetOf(names_of_all_profiles()));
  EXPECT_THAT(at_run, IsSupersetOf(names_of_all_profiles()));
  EXPECT_THAT(at_run, Contains("mine.yaml")) << "a file is one as well";
  EXPECT_THAT(in_bash("emtb simulate mine.yaml fh2_r"), UnorderedElementsAre("fh2_ramp", "fh2_random"));
}

TEST_F(Completion, KnowsTheThirdWordAndThatThereIsNone) {
  EXPECT_THAT(in_bash("emtb bench check "), UnorderedElementsAre("config", "mine.yaml", "run 1.csv"));
  EXPECT_THAT(in_bash("emtb bench calibrate mine.yaml om"), ElementsAre("omega"));
  EXPECT_THAT(in_bash("emtb add windage m"), ElementsAre("mine.yaml"));
  EXPECT_THAT(in_bash("emtb diagnose mine.yaml a.csv b.csv m"), ElementsAre("mine.yaml"))
      << "one session after the other";
  EXPECT_THAT(in_bash("emtb effects windage "), IsEmpty());
  EXPECT_THAT(in_bash("emtb status "), IsEmpty());
}

TEST_F(Completion, KnowsWhatAnOptionMayBe) {
  EXPECT_THAT(in_bash("emtb export-model mine.yaml --to "),
              ElementsAre("c", "octave", "state-space", "transfer-function", "modelica", "fmu"));
  EXPECT_THAT(in_bash("emtb export-model --to = oct"), ElementsAre("octave")) << "as bash divides --to=oct";
  EXPECT_THAT(in_bash("emtb export s.csv --mat "), ElementsAre("5", "7.3"));
  EXPECT_EQ(in_bash("emtb diagnose m.yaml s.csv --without "), ids_of_all_effects());
  EXPECT_THAT(in_bash("emtb diagnose m.yaml s.csv --only windage tacho_l"), ElementsAre("tacho_lag"));
  EXPECT_THAT(in_bash("emtb diagnose m.yaml s.csv --only windage,tacho_l"), ElementsAre("windage,tacho_lag"));
  EXPECT_THAT(in_bash("emtb simulate m.yaml p.yaml --rate "), IsEmpty()) << "a number";
  EXPECT_THAT(in_bash("emtb info s.csv --json m"), ElementsAre("mine.yaml"));
  EXPECT_THAT(in_bash("emtb --socket x.sock bench "), ElementsAre("check", "calibrate", "spin"));
  EXPECT_THAT(in_bash("emtb bench --reset s"), ElementsAre("spin")) << "a flag takes no word";
}

/// All words that the help of a command puts in capitals have an argument in both; zsh itself is asked where there is
/// one.
TEST_F(Completion, ZshKnowsTheSame) {
  write_completion("zsh");
  const std::string text = read(path("emtb.zsh"));
  EXPECT_THAT(text, testing::HasSubstr("'1:WHAT:(check calibrate spin)'"));
  EXPECT_THAT(text, testing::HasSubstr("--held-out["));
  const char* const zsh = std::getenv("EMTB_ZSH");
  const std::string program = zsh != nullptr ? zsh : "/usr/bin/zsh";
  if (!std::filesystem::exists(program)) GTEST_SKIP() << "no zsh here";
  Process parsed({program, "-n", path("emtb.zsh").string()}, path("zsh"));
  EXPECT_EQ(parsed.wait(), 0) << parsed.err();
}

}  // namespace
}  // namespace emtb
