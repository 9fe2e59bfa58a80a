#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <fstream>
#include <optional>

#include "tests/tools/command_caller.h"
#include "tools/kept/answers.h"

namespace emtb {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> all;
  if (!fs::exists(folder)) return all;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) all.push_back(entry.path());
  return all;
}

class KeptAnswersTest : public CommandCaller {
 protected:
  KeptAnswersTest() {
    if (const char* before = getenv("XDG_CACHE_HOME")) before_ = before;
    setenv("XDG_CACHE_HOME", path("cache").c_str(), 1);
  }
  ~KeptAnswersTest() override { before_ ? setenv("XDG_CACHE_HOME", before_->c_str(), 1) : unsetenv("XDG_CACHE_HOME"); }

  /// A run of a motor that turns, rows that `emtb info` counts.
  std::string session(const std::string& name, int rows = 50) const {
    std::string text = "t_s,e_a_V,i_a_A,omega_rad_s\n";
    for (int k = 0; k < rows; ++k) text += std::to_string(0.01 * k) + ",2," + std::to_string(0.1 * k) + ",30\n";
    return write(name, text);
  }

  std::vector<fs::path> kept() const { return files_in(path("cache/emtb/answers")); }

  /// Whether the next call of the same words is given what was kept.
  bool was_given(const std::vector<std::string>& words) {
    const std::vector<fs::path> before = kept();
    const auto long_ago = fs::file_time_type::clock::now() - std::chrono::hours(24);
    for (const fs::path& file : before) fs::last_write_time(file, long_ago);
    call(words);
    const bool none_is_new = kept().size() == before.size();
    const bool one_was_found = std::ranges::any_of(
        before, [&](const fs::path& file) { return fs::exists(file) && fs::last_write_time(file) > long_ago; });
    return none_is_new && one_was_found;
  }

 private:
  std::optional<std::string> before_;
};

TEST_F(KeptAnswersTest, TheSameQuestionOfTheSameFilesIsAnsweredAlike) {
  const std::string file = session("a.csv");
  EXPECT_EQ(call({"info", file, "--json", path("first.json")}), 0) << last->err();
  const std::string first = last->out();
  EXPECT_THAT(kept(), SizeIs(1));
  fs::rename(path("first.json"), path("kept.json"));
  EXPECT_TRUE(was_given({"info", file, "--json", path("first.json")}));
  EXPECT_EQ(last->out(), first);
  EXPECT_EQ(read(path("first.json")), read(path("kept.json"))) << "what it wrote is written again";
}

TEST_F(KeptAnswersTest, ChangedBytesAreAnotherQuestion) {
  const std::string file = session("a.csv");
  call({"info", file});
  session("a.csv", 60);
  call({"info", file});
  EXPECT_THAT(last->out(), HasSubstr("60"));
  // Of the same length, and with its times set back.
  const struct timespec times[] = {{1'000'000'000, 0}, {1'000'000'000, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, file.c_str(), times, 0), 0);
  call({"info", file});
  std::string text = read(file);
  text.replace(text.rfind(",30\n"), 4, ",99\n");
  write("a.csv", text);
  ASSERT_EQ(utimensat(AT_FDCWD, file.c_str(), times, 0), 0);
  call({"info", file});
  EXPECT_THAT(last->out(), HasSubstr("99"));
}

TEST_F(KeptAnswersTest, AFileThatWasOnlyTouchedIsTheSame) {
  const std::string file = session("a.csv");
  call({"info", file});
  fs::last_write_time(file, fs::file_time_type::clock::now());
  EXPECT_TRUE(was_given({"info", file}));
}

TEST_F(KeptAnswersTest, OtherWordsAreAnotherQuestion) {
  const std::string file = session("a.csv"), other = session("b.csv");
  call({"info", file});
  call({"info", other});
  call({"info", file + "@0:0.2"});
  call({"check", file});
  EXPECT_THAT(kept(), SizeIs(4));
}

TEST_F(KeptAnswersTest, NoCacheNeitherLooksNorKeeps) {
  const std::string file = session("a.csv");
  EXPECT_EQ(call({"info", file, "--no-cache"}), 0);
  EXPECT_THAT(kept(), IsEmpty());
  call({"info", file});
  EXPECT_FALSE(was_given({"--no-cache", "info", file}));
}

TEST_F(KeptAnswersTest, WhatIsRefusedIsNotKept) {
  EXPECT_EQ(call({"info", write("a.csv", "t_s,omega_rad_s\n0,1\n0,2\n")}), 2);
  EXPECT_EQ(call({"info", path("not_there.csv")}), 2);
  EXPECT_THAT(kept(), IsEmpty());
}

TEST_F(KeptAnswersTest, AnAnswerThatIsCutOffIsWorkedOutAnew) {
  const std::string file = session("a.csv");
  call({"info", file});
  const std::string first = last->out();
  const std::string whole = read(kept().front());
  for (const std::size_t length : {std::size_t{0}, whole.size() / 2, whole.size() - 1}) {
    std::ofstream(kept().front(), std::ios::binary) << whole.substr(0, length);
    EXPECT_EQ(call({"info", file}), 0);
    EXPECT_EQ(last->out(), first) << "cut at " << length;
  }
}

TEST_F(KeptAnswersTest, NoChangedByteIsBelieved) {
  const std::vector<FileState> files{*look_at(session("a.csv"))};
  const Answers answers(path("answers"));
  answers.keep("one", files, {.code = 1, .out = "out\n", .err = "err\n", .written = {"{}\n"}});
  const fs::path place = files_in(path("answers")).front();
  const std::string whole = read(place);
  const auto given = answers.find("one", files);
  ASSERT_TRUE(given);
  EXPECT_EQ(given->code, 1);
  EXPECT_EQ(given->out + given->err, "out\nerr\n");
  EXPECT_THAT(given->written, ElementsAre("{}\n"));
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string damaged = whole;
    damaged[at] = static_cast<char>(damaged[at] ^ 1);
    std::ofstream(place, std::ios::binary) << damaged;
    EXPECT_FALSE(answers.find("one", files)) << "byte " << at;
  }
}

TEST_F(KeptAnswersTest, AFolderThatOthersCanWriteToIsNotBelieved) {
  const std::string file = session("a.csv");
  call({"info", file});
  fs::permissions(path("cache/emtb/answers"), fs::perms::all);
  EXPECT_FALSE(was_given({"info", file}));
}

TEST_F(KeptAnswersTest, WithoutAPlaceForItAnAnswerIsGivenAllTheSame) {
  const std::string file = session("a.csv");
  write("cache", "no folder");
  EXPECT_EQ(call({"info", file}), 0) << last->err();
  EXPECT_THAT(last->err(), IsEmpty());
}

TEST_F(KeptAnswersTest, ThoseFoundLongestAgoMakeRoom) {
  const fs::path folder = path("answers");
  const std::vector<FileState> files{*look_at(session("a.csv"))};
  const Answer answer{.code = 0, .out = std::string(1000, 'x'), .err = "", .written = {}};
  const Answers answers(folder, 4000);
  answers.keep("one", files, answer);
  fs::last_write_time(files_in(folder).front(), fs::file_time_type::clock::now() - std::chrono::hours(2));
  answers.keep("two", files, answer);
  ASSERT_TRUE(answers.find("one", files)) << "and is the latest from now on";
  for (const fs::path& file : files_in(folder)) EXPECT_GT(fs::file_size(file), 1200u);
  answers.keep("three", files, answer);
  EXPECT_THAT(files_in(folder), SizeIs(2));
  EXPECT_TRUE(answers.find("three", files));
}

}  // namespace
}  // namespace emtb
