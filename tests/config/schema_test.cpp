#include "config/schema.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

namespace emtb {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

const std::filesystem::path config = std::filesystem::path(EMTB_SOURCE_DIR) / "config";

std::vector<std::string> problems(const YamlMap& file) {
  std::vector<std::string> lines;
  for (const FileProblem& one : schema_problems(file, config / "bench.schema.json")) lines.push_back(one.text);
  return lines;
}

/// The shipped desk bench with lines changed: what a line begins with, and what stands there instead.
std::vector<std::string> problems_with(const std::vector<std::pair<std::string, std::string>>& changes) {
  std::string text = YamlMap::read_text(config / "benches/desk-simulated.yaml");
  for (const auto& [from, to] : changes) {
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
  }
  return problems(YamlMap::parse(text, "mine.yaml"));
}

TEST(Schema, EveryShippedBenchIsAsItSays) {
  int benches = 0;
  for (const auto& entry : std::filesystem::directory_iterator(config / "benches")) {
    EXPECT_THAT(problems(YamlMap::load(entry.path())), IsEmpty()) << entry.path();
    ++benches;
  }
  EXPECT_GE(benches, 7);
}

TEST(Schema, AllThatIsWrongIsNamedAtOnceWithLineAndKey) {
  const auto lines = problems_with({{"rate: 1000 ", "rate: fast "},
                                    {"safe: 0 ", "save: 0 "},
                                    {"omega: 620", "omega: -3"},
                                    {"driver: simulated_daq", "driver: daq"},
                                    {"    J: 6.0e-5", "    JJ: 6.0e-5"}});
  EXPECT_THAT(lines, ElementsAre(HasSubstr("mine.yaml:5: rate must be a number, not `fast`: [Hz] of the loop"),
                                 AllOf(HasSubstr(":8: reference.safe is missing"), HasSubstr("standstill")),
                                 AllOf(HasSubstr(":12: reference.save is not known here. Known: device, min")),
                                 HasSubstr(":16: limits.omega is -3, but must be above 0"),
                                 HasSubstr("devices.daq.driver is `daq`. Known: comedi"),
                                 HasSubstr("simulation.motor.J is missing: [kg m2]"),
                                 HasSubstr("simulation.motor.JJ is not known here")));
}

TEST(Schema, EachDriversKeysAreItsOwn) {
  EXPECT_THAT(problems_with({{"    bits: 12\n", "    bits: 12.5\n    pacer: scan\n"}}),
              ElementsAre(HasSubstr("devices.daq.bits must be a whole number, not `12.5`"),
                          HasSubstr("devices.daq.pacer is not known here. Known: driver, bits, clock, channels")));
}

TEST(Schema, WordsListsAndNumbersAreToldApart) {
  EXPECT_THAT(problems_with({{"pace: 1 ", "pace: quick "}}), ElementsAre(HasSubstr("pace must be a number or max")));
  EXPECT_THAT(problems_with({{"pace: 1 ", "pace: max "}}), IsEmpty());
  EXPECT_THAT(problems_with({{"range: [-30, 30]", "range: [-30]"}}), ElementsAre(HasSubstr("range has 1 values")));
  EXPECT_THAT(problems_with({{"range: [-30, 30]", "range: 30"}}), ElementsAre(HasSubstr("range must be a list")));
  EXPECT_THAT(problems_with({{"range: [-30, 30],", "range: [-30, 30], scale: 0,"}}),
              ElementsAre(HasSubstr("scale must not be 0")));
  EXPECT_THAT(problems_with({{"realtime: prefer", "realtime: perhaps"}}),
              ElementsAre(HasSubstr("Known: require, prefer, off")));
  EXPECT_THAT(problems_with({{"rate: 1000 ", "rate: 20000 "}}),
              ElementsAre(HasSubstr("is 20000, but must be 100 to 10000")));
}

}  // namespace
}  // namespace emtb
