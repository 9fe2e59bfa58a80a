#include "tests/mutations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>

#include "config/bench.h"
#include "config/formula.h"
#include "config/mapping.h"
#include "config/model.h"
#include "config/profile.h"

namespace emtb {
namespace {

std::vector<std::string> files(const std::string& folder) {
  std::vector<std::string> texts;
  for (const auto& entry :
       std::filesystem::directory_iterator(std::filesystem::path(EMTB_SOURCE_DIR) / "config" / folder)) {
    if (entry.path().extension() == ".yaml") texts.push_back(YamlMap::read_text(entry.path()));
  }
  std::ranges::sort(texts);  // a folder has no order
  return texts;
}

TEST(Mutations, OfABenchAreReadOrRefusedInOneLine) {
  EXPECT_GT(read_mutations(files("benches"), 3000, [](const std::string& text) { parse_bench(text, "b.yaml"); }), 100);
}

TEST(Mutations, OfAModelAreReadOrRefusedInOneLine) {
  EXPECT_GT(read_mutations(files("models"), 3000,
                           [](const std::string& text) { read_model(YamlMap::parse(text, "m.yaml")); }),
            100);
}

TEST(Mutations, OfAProfileAreReadOrRefusedInOneLine) {
  EXPECT_GT(read_mutations(files("profiles"), 3000,
                           [](const std::string& text) { read_experiment(YamlMap::parse(text, "p.yaml")); }),
            100);
}

TEST(Mutations, OfAFormulaAreReadOrRefusedInOneLine) {
  const std::vector<std::string> parameters{"a", "b"};
  EXPECT_GT(read_mutations({"-a*omega^3 + b", "-a*sign(omega)*exp(-abs(omega)/b)", "omega > a ? b : -b*tanh(theta/2)",
                            "-a*min(omega, i_a, b)*sin(3*theta)"},
                           5000, [&](const std::string& text) { parse_formula(text, parameters); }),
            100);
}

}  // namespace
}  // namespace emtb
