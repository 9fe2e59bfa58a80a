#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "session/hdf5.h"
#include "tests/fuzz/file_of.h"
#include "tests/fuzz/targets.h"

namespace emtb::fuzz {
namespace {

namespace fs = std::filesystem;

class Corpus : public testing::TestWithParam<Target> {};

/// Seeds, what a fuzzer kept for the new ways that it took, and every input that something was found with.
TEST_P(Corpus, IsReadOrRefusedAsItMust) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(fs::path(EMTB_CORPUS) / GetParam().name)) {
    files.push_back(entry.path());
  }
  std::ranges::sort(files);
  ASSERT_GE(files.size(), 2u) << "a corpus has seeds";
  for (const fs::path& file : files) {
    std::ifstream in(file, std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(in), {}};
    try {
      GetParam().run(bytes);
    } catch (const std::exception& e) {
      ADD_FAILURE() << file << ": " << e.what();
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Of, Corpus, testing::ValuesIn(targets),
                         [](const auto& test) { return std::string(test.param.name); });

/// A reader that refused all would pass, too.
TEST(CorpusOfHdf5, HasSeedsThatAreSessions) {
  for (const auto& entry : fs::directory_iterator(fs::path(EMTB_CORPUS) / "hdf5")) {
    if (!entry.path().filename().string().starts_with("seed-")) continue;
    std::ifstream in(entry.path(), std::ios::binary);
    const FileOf file(std::string{std::istreambuf_iterator<char>(in), {}});
    EXPECT_NO_THROW(read_hdf5(file.path())) << entry.path();
  }
}

TEST(CorpusOfAll, HasAFolderForEachTargetAndNoOther) {
  std::vector<std::string> folders, names;
  for (const auto& entry : fs::directory_iterator(EMTB_CORPUS)) folders.push_back(entry.path().filename());
  for (const Target& target : targets) names.emplace_back(target.name);
  std::ranges::sort(folders);
  std::ranges::sort(names);
  EXPECT_EQ(folders, names);
}

TEST(CorpusOfAll, IsSmall) {
  std::uintmax_t bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(EMTB_CORPUS)) {
    if (entry.is_regular_file()) bytes += entry.file_size();
  }
  EXPECT_LT(bytes, 2u << 20) << "keep what finds something, or takes a way that no other does";
}

}  // namespace
}  // namespace emtb::fuzz
