#include "config/format.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "config/bench.h"
#include "config/model.h"
#include "hal/format_version.h"
#include "tests/config/complains.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const std::filesystem::path kept = std::filesystem::path(EMTB_SOURCE_DIR) / "tests/formats";

TEST(Formats, BenchesAndModelsOfEachVersionAreRead) {
  for (const char* version : {"0", "1"}) {
    const BenchConfig bench = read_bench(kept / ("bench-" + std::string(version) + ".yaml"));
    EXPECT_EQ(bench.name, "desk-simulated");
    EXPECT_EQ(bench.reference.limits.max, 6);
    const Model model = read_model(kept / ("model-" + std::string(version) + ".yaml"));
    EXPECT_EQ(model.name, "desk");
    EXPECT_EQ(model.at(base::R_a).value, 1);
  }
}

TEST(Formats, ANewerFileIsRefusedInOneLineBeforeItsKeysAreLookedAt) {
  const auto bench = complaint([] { parse_bench("format: emtb bench 2\nunheard_of: 1\n", "new.yaml"); });
  EXPECT_THAT(bench, AllOf(HasSubstr("new.yaml:1: made by a newer emtb"), HasSubstr("`emtb bench 2`"),
                           HasSubstr("up to 1"), Not(HasSubstr("unheard_of"))));
  const auto model =
      complaint([] { read_model(YamlMap::parse("unheard_of: 1\nformat: emtb model 17\n", "new.yaml")); });
  EXPECT_THAT(model, HasSubstr("made by a newer emtb"));
}

TEST(Formats, AFileOfAnotherKindIsToldSo) {
  EXPECT_THAT(complaint([] { read_model(YamlMap::parse("name: x\nformat: emtb bench 1\n", "x.yaml")); }),
              AllOf(HasSubstr("x.yaml:2: format"), HasSubstr("Write emtb model 1")));
}

TEST(Formats, WhatIsWrittenSaysItsVersion) {
  const Model model = read_model(kept / "model-0.yaml");
  EXPECT_THAT(to_yaml(model), HasSubstr("format: emtb model 1\n"));
  EXPECT_EQ(read_model(YamlMap::parse(to_yaml(model), "again.yaml")).name, "desk");
}

TEST(Formats, AnUpgradeAddsItsLineAndKeepsAllElse) {
  for (const char* kind : {"bench", "model"}) {
    const std::string name = std::string(kind) + "-0.yaml";
    const std::string before = YamlMap::read_text(kept / name);
    const std::string after = upgraded(before, name);
    EXPECT_EQ(after, YamlMap::read_text(kept / (std::string(kind) + "-1.yaml")));
    EXPECT_EQ(upgraded(after, name), after);
  }
  EXPECT_EQ(upgraded("# mine\r\nname: x\r\nparameters: {}\r\n", "x.yaml"),
            "# mine\r\nformat: emtb model 1\r\nname: x\r\nparameters: {}\r\n");
  EXPECT_EQ(upgraded("format: emtb model 0   # old\nparameters: {}\n", "x.yaml"),
            "format: emtb model 1   # old\nparameters: {}\n");
}

TEST(Formats, AnUpgradeRefusesWhatHasNoVersionAndWhatIsNewer) {
  EXPECT_THAT(complaint([] { upgraded("kind: step\nlevel: 2\n", "p.yaml"); }),
              HasSubstr("neither a bench nor a model"));
  EXPECT_THAT(complaint([] { upgraded("{parameters: {}}\n", "p.yaml"); }), HasSubstr("braces"));
  EXPECT_THAT(complaint([] { upgraded("format: emtb model 2\nparameters: {}\n", "p.yaml"); }),
              HasSubstr("made by a newer emtb"));
}

TEST(Formats, WordsOfAVersionAreReadAsTheyAreWritten) {
  EXPECT_EQ(format_version(format_words("session", 3), "session"), 3);
  EXPECT_EQ(format_version("emtb session 1", "bench"), std::nullopt);
  EXPECT_EQ(format_version("emtb session one", "session"), std::nullopt);
  EXPECT_EQ(format_version("emtb session 1 or so", "session"), std::nullopt);
}

}  // namespace
}  // namespace emtb
