#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>

#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ConfigCommand : public CommandCaller {
 protected:
  /// The shipped desk bench with some of its text replaced.
  std::string bench(const std::vector<std::pair<std::string, std::string>>& changes = {}) {
    std::string text = read(std::filesystem::path(EMTB_CONFIG) / "benches/desk-simulated.yaml");
    for (const auto& [from, to] : changes) text.replace(text.find(from), from.size(), to);
    return write("bench.yaml", text).string();
  }
  std::string shipped(const std::string& file) { return (std::filesystem::path(EMTB_CONFIG) / file).string(); }
  long lines() const { return std::ranges::count(last->out(), '\n'); }
};

TEST_F(ConfigCommand, EveryShippedFileHasNothingWrong) {
  std::vector<std::string> words{"config", "check"};
  for (const char* folder : {"benches", "models", "profiles", "mappings", "candidates"}) {
    for (const auto& entry : std::filesystem::directory_iterator(shipped(folder))) {
      if (entry.path().extension() != ".yaml") continue;
      words.push_back(entry.path());
    }
  }
  ASSERT_GT(words.size(), 40U);
  EXPECT_EQ(call(words), 0) << last->out();
  EXPECT_EQ(lines(), static_cast<long>(words.size()) - 2);
}

TEST_F(ConfigCommand, NamesEachProblemOfABenchInALineOfItsOwn) {
  EXPECT_EQ(call({"config", "check",
                  bench({{"omega: 620", "omegaa: 620"},
                         {"    bits: 12\n", "    bits: many\n"},
                         {"    max: 24             # [V]", "    max: -24            # [V]"},
                         {"../models/desk.yaml", "nowhere.yaml"}})}),
            1);
  EXPECT_THAT(last->out(), AllOf(HasSubstr("bench.yaml:16: limits.omegaa is not known here. Known: omega, i_a"),
                                 HasSubstr("devices.daq.bits must be a whole number, not `many`")));
  EXPECT_EQ(lines(), 2) << last->out();
}

TEST_F(ConfigCommand, SaysWhatOnlyTheReadersKnow) {
  EXPECT_EQ(
      call({"config", "check", bench({{"    max: 24 ", "    max: -24 "}, {"../models/desk.yaml", "nowhere.yaml"}})}),
      1);
  EXPECT_THAT(last->out(), AllOf(HasSubstr("simulation.driver.max leaves no voltage"), HasSubstr("nowhere.yaml")));
  EXPECT_EQ(call({"config", "check", bench({{"device: daq", "device: dac"}})}), 1);
  EXPECT_THAT(last->out(), HasSubstr(":9: reference.device is `dac`, which `devices` does not have. It has: daq"));
  EXPECT_EQ(call({"config", "check", bench({{"simulation:", "simulated:"}})}), 1);
  EXPECT_THAT(last->out(), HasSubstr("simulated is not known here"));
}

TEST_F(ConfigCommand, ADeviceThatOnlyMeasuresDrivesNoReference) {
  EXPECT_EQ(call({"config", "check",
                  bench({{"devices:\n", "devices:\n  meter: {driver: simulated_meter, period: 0.5}\n"},
                         {"device: daq", "device: meter"}})}),
            1);
  EXPECT_THAT(last->out(), HasSubstr("reference.device is `meter`, which has no analog output"));
}

TEST_F(ConfigCommand, ChecksModelsProfilesAndWhatIsNeither) {
  const auto model = write("model.yaml", "name: x\nparameters:\n  R_a: {value: -1}\n").string();
  const auto profile = write("profile.yaml", "name: p\nkind: stair\n").string();
  const auto other = write("other.yaml", "hello: 1\n").string();
  const auto newer = write("newer.yaml", "format: emtb bench 2\ndevices: 1\nelse: 2\n").string();
  EXPECT_EQ(call({"config", "check", model, profile, other, newer, shipped("models/desk.yaml")}), 1);
  EXPECT_THAT(last->out(),
              AllOf(HasSubstr("model.yaml:3: parameters.R_a"), HasSubstr("profile.yaml:2: kind is `stair`"),
                    HasSubstr("other.yaml:1: is no file of emtb's"), HasSubstr("newer.yaml:1: made by a newer emtb"),
                    HasSubstr("desk.yaml: model, nothing wrong")));
  EXPECT_EQ(lines(), 5) << last->out();
}

TEST_F(ConfigCommand, UpgradeShowsTheDifferenceAndWritesOnlyWhenTold) {
  const std::string file =
      write("old.yaml", read(std::filesystem::path(EMTB_SOURCE_DIR) / "tests/formats/model-0.yaml"));
  const std::string before = read(file);
  EXPECT_EQ(call({"config", "upgrade", file}), 2);  // nobody can be asked
  EXPECT_THAT(last->out(),
              AllOf(HasSubstr("+ format: emtb model 1\n"), HasSubstr("  name: desk\n"), Not(HasSubstr("- "))));
  EXPECT_THAT(last->err(), HasSubstr("--yes"));
  EXPECT_EQ(read(file), before);
  EXPECT_EQ(call({"config", "upgrade", "--yes", file}), 0) << last->err();
  EXPECT_EQ(read(file), read(std::filesystem::path(EMTB_SOURCE_DIR) / "tests/formats/model-1.yaml"));
  EXPECT_EQ(call({"config", "upgrade", file}), 0);
  EXPECT_THAT(last->out(), HasSubstr("newest form already"));
}

TEST_F(ConfigCommand, PrintsTheSchema) {
  ASSERT_EQ(call({"config", "schema"}), 0);
  EXPECT_EQ(last->out(), read(shipped("bench.schema.json")));
}

TEST_F(ConfigCommand, RefusesWithOneLine) {
  EXPECT_EQ(call({"config", "mend", "x"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("Known: check, upgrade, schema"));
  EXPECT_EQ(call({"config", "check"}), 2);
  EXPECT_THAT(last->err(), HasSubstr("which FILE?"));
}

}  // namespace
}  // namespace emtb
