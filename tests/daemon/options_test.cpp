#include "daemon/options.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "hal/error.h"

namespace emtb {
namespace {

Options parse(std::vector<std::string> words) {
  words.insert(words.begin(), "emtbd");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  return parse_options(static_cast<int>(words.size()), argv.data());
}

std::string complaint(const std::vector<std::string>& words) {
  try {
    parse(words);
  } catch (const Error& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return e.what();
  }
  return "nothing";
}

TEST(Options, AreThoseOfTheManual) {
  const Options o = parse({"--config", "b.yaml", "--socket", "s", "--data=d", "--pace", "20"});
  EXPECT_EQ(o.config, "b.yaml");
  EXPECT_EQ(o.socket, "s");
  EXPECT_EQ(o.data, "d");
  EXPECT_EQ(o.pace, 20);
  EXPECT_FALSE(o.safe);
  EXPECT_EQ(parse({"--config", "b"}).data, "sessions");
  EXPECT_FALSE(parse({"--config", "b"}).pace);
  EXPECT_TRUE(std::isinf(*parse({"--config", "b", "--pace", "max"}).pace));
  EXPECT_TRUE(parse({"--config", "b", "--safe"}).safe);
  EXPECT_TRUE(parse({"--help"}).help);
}

TEST(Options, ComplainInOneLineThatNamesTheWord) {
  using testing::HasSubstr;
  EXPECT_THAT(complaint({}), HasSubstr("--config"));
  EXPECT_THAT(complaint({"--config"}), HasSubstr("--config wants a value"));
  EXPECT_THAT(complaint({"--config", "b", "--fast"}), HasSubstr("--fast: no such option"));
  EXPECT_THAT(complaint({"--config", "b", "more"}), HasSubstr("more: unexpected"));
  for (const char* pace : {"0", "-1", "fast", "", "nan", "inf", "1x"}) {
    EXPECT_THAT(complaint({"--config", "b", "--pace", pace}), HasSubstr("--pace")) << pace;
  }
}

}  // namespace
}  // namespace emtb
