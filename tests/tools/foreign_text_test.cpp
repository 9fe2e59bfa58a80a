#include <gmock/gmock.h>

#include <algorithm>
#include <sstream>

#include "session/spec.h"
#include "tests/blind/recording.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using testing::HasSubstr;
using testing::Not;

const char* const hostile = "quiet\n  event 101 at 2 s: over_speed\x1b[2J\x9b\x07";

/// What others wrote into a session or a model, on the terminal of who opens it.
class ForeignText : public CommandCaller {
 protected:
  std::string model_named(const std::string& name) const {
    std::string text = read(std::filesystem::path(EMTB_CONFIG) / "models/fh2.yaml");
    const std::string given = "name: linear";
    return write("model.yaml", text.replace(text.find(given), given.size(), "name: \"" + name + "\""));
  }

  /// Two runs, whose names move the cursor.
  std::string recordings() const {
    const blind::Bench bench = blind::slow_bench();
    std::ostringstream csv;
    csv << "run,t_s,u_ref_V,omega_rad_s\n";
    for (const char* name : {"a\x1b[31mred", "b\x07\x7f"}) {
      const emtb::Run run = record(bench, bench.train[0], static_cast<std::uint64_t>(name[0]));
      const Series &u = run.at(Signal::u_ref), &omega = run.at(Signal::omega);
      for (std::size_t k = 0; k < std::min(u.t.size(), omega.t.size()); k += 20)
        csv << name << "," << omega.t[k] << "," << u.value[k] << "," << omega.value[k] << "\n";
    }
    return write("runs.csv", csv.str());
  }

  void expect_nothing_that_moves_the_cursor(const std::string& command) const {
    for (const std::string& text : {last->out(), last->err()}) {
      EXPECT_TRUE(std::ranges::none_of(
          text, [](char c) { return (static_cast<unsigned char>(c) < 0x20 && c != '\n' && c != '\t') || c == 0x7f; }))
          << command << ": " << text;
    }
  }
};

TEST_F(ForeignText, ANoteFakesNoEventAndSendsNoEscapeCode) {
  Session session;
  session.runs.push_back(record(blind::slow_bench(), blind::slow_bench().train[0], 1));
  session.attributes = {{"note", hostile}, {hostile, "of an attribute"}};
  session.events = {{1, event_code::gap, hostile}};
  write_session(path("noted.h5"), session);
  ASSERT_EQ(call({"info", path("noted.h5")}), 0) << last->err();
  expect_nothing_that_moves_the_cursor("info");
  EXPECT_THAT(last->out(), HasSubstr("note: quiet?  event 101 at 2 s: over_speed?[2J"));
  EXPECT_THAT(last->out(), Not(HasSubstr("\n  event 101")));
}

TEST_F(ForeignText, NamesOfRunsAndModelsSendNoEscapeCodeWhateverReadsThem) {
  const std::string runs = recordings(), model = model_named(R"(m\e[31m\n\x07)");
  const std::vector<std::vector<std::string>> calls{{"info", runs},
                                                    {"check", runs, runs},
                                                    {"compare", model, runs},
                                                    {"calibrate", model, runs, "--out", path("m.yaml")},
                                                    {"diagnose", model, runs},
                                                    {"trend", model, runs},
                                                    {"estimate", runs},
                                                    {"report", model, runs, "--out", path("page.html")},
                                                    {"export", model, "--to", "gains", "--at", "20"},
                                                    {"simulate", model, runs}};
  for (const auto& words : calls) {
    call(words);
    EXPECT_GT(last->out().size() + last->err().size(), 0u) << words[0];
    expect_nothing_that_moves_the_cursor(words[0]);
  }
  ASSERT_EQ(call({"compare", path("m.yaml"), runs}), 0) << "what was written can be read: " << last->err();
}

TEST_F(ForeignText, AFileIsShownWithoutWhatItWouldDoToATerminal) {
  std::string text = read(std::filesystem::path(EMTB_SOURCE_DIR) / "tests/formats/model-0.yaml");
  const std::string file = write("old.yaml", text.insert(text.find("name: "), "# \x1b[31mred\x07\ttab\n"));
  call({"config", "upgrade", file});
  expect_nothing_that_moves_the_cursor("config upgrade");
  EXPECT_THAT(last->out(), HasSubstr("# ?[31mred?\ttab"));
}

TEST_F(ForeignText, AComplaintIsNoLongerThanAPersonReads) {
  const std::string long_word(150'000, 'x'), model = model_named("m");
  const std::string text = read(model);
  const std::vector<std::vector<std::string>> calls{
      {"info", write("column.csv", "t_s," + long_word + "\n0,1\n")},
      {"info", write("cell.csv", "t_s,omega_rad_s\n0," + long_word + "\n")},
      {"info", path(long_word.substr(0, 200) + ".csv"), "--map", write("map.yaml", long_word + ": 1\n")},
      {"calibrate", write("key.yaml", text + long_word + ": 1\n"), recordings()},
      {"diagnose", model, recordings(), "--candidates",
       write("formula.yaml", "f: {torque: \"-" + long_word + "\", parameters: {}}\n")},
      {"diagnose", model, recordings(), "--only", long_word.substr(0, 100'000)},
      {long_word.substr(0, 100'000)}};
  for (const auto& words : calls) {
    EXPECT_EQ(call(words), 2) << words[0];
    const std::string line = last->err();
    EXPECT_EQ(std::ranges::count(line, '\n'), 1) << words[0];
    EXPECT_LT(line.size(), 1100u) << words[0] << ": " << line.substr(0, 200);
  }
}

}  // namespace
}  // namespace emtb
