#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "model/catalogue.h"
#include "tests/tools/command_caller.h"

namespace emtb {
namespace {

using testing::Contains;
using testing::Each;
using testing::HasSubstr;
using testing::StartsWith;

/// What `emtb` prints where lines have an end.
class TerminalWidth : public CommandCaller {
 protected:
  /// One of config/, copied into the folder: names are short there.
  std::string shipped_file(const std::string& file) {
    const std::string name = std::filesystem::path(file).filename();
    write(name, read(std::filesystem::path(EMTB_CONFIG) / file));
    return name;
  }

  std::string session() {
    call({"simulate", std::string(EMTB_CONFIG) + "/models/fh2.yaml", "fh2_step_mid", "--out", path("s.csv")});
    return "s.csv";
  }

  /// A session in which the speed stands for a while and the angle is of another motion: findings with long lines.
  std::string held() {
    std::string text = "t_s,e_a_V,omega_rad_s\n";
    for (int k = 0; k < 4000; ++k) {
      const double t = 1e-3 * k, e_a = 20 + 10 * std::sin(3 * t);
      const double omega = k > 1000 && k < 3000 ? 33.25 : 1.5 * e_a + 0.01 * ((k * 7919) % 13);
      text += std::to_string(t) + "," + std::to_string(e_a) + "," + std::to_string(omega) + "\n";
    }
    write("held.csv", text);
    return "held.csv";
  }
};

MATCHER_P(Fits, columns, "") {
  return std::ranges::count_if(arg, [](char c) { return (c & 0xC0) != 0x80; }) <= columns;
}

TEST_F(TerminalWidth, NoLineIsLongerThanTheTerminal) {
  const std::string run = session(), bad = held(), model = shipped_file("models/fh2.yaml");
  const std::string bench = shipped_file("benches/fh2-simulated.yaml");
  const std::vector<std::vector<std::string>> calls{
      {"effects"},
      {"effects", "stribeck_friction"},
      {"info", run},
      {"gains", model},
      {"check", bad},
      {"check", bad, "--model", model},
      {"devices"},
      {"bench", "check", bench},
      {"table", model, shipped_file("models/desk.yaml"), "--truth", bench},
      {"profiles"},
      {"compare", model, shipped_file("models/fh2-one-step.yaml"), run}};
  for (const auto& words : calls) {
    for (const unsigned short columns : {80, 60}) {
      const auto lines = lines_on_terminal(words, columns);
      EXPECT_GT(lines.size(), words[0] == "devices" ? 0U : 1U) << words[0];
      EXPECT_THAT(lines, Each(Fits(columns))) << words[0] << " " << words.back() << " at " << columns;
    }
  }
}

TEST_F(TerminalWidth, EffectsShowTheirEquationsBelowWhereTheyHaveNoRoomBeside) {
  const auto narrow = lines_on_terminal({"effects"}, 80);
  const auto wide = lines_on_terminal({"effects"}, 200);
  EXPECT_EQ(wide.size(), 1 + effect_count);
  EXPECT_GE(narrow.size(), 1 + 2 * effect_count);
  for (std::size_t i = 0; i < effect_count; ++i) {
    const std::string id(effect_catalogue()[i].id), equation(effect_catalogue()[i].equation);
    EXPECT_THAT(wide[1 + i], StartsWith(id + " "));
    EXPECT_THAT(wide[1 + i], HasSubstr("  " + equation));
    EXPECT_THAT(narrow, Contains(StartsWith(id + " ")));
  }
  EXPECT_THAT(narrow, Contains("    T = c_w omega |omega|"));
}

TEST_F(TerminalWidth, ARowStaysWholeWhereItIsPiped) {
  ASSERT_EQ(call({"effects"}), 0);
  EXPECT_THAT(last->out(), HasSubstr("\nwindage                   shaft     c_w [N m s2/rad2]"));
  EXPECT_THAT(last->out(), HasSubstr("T = c_w omega |omega|\n"));
  EXPECT_EQ(std::ranges::count(last->out(), '\n'), 1 + effect_count);
  EXPECT_EQ(call({"check", path(held())}), 1);
  EXPECT_THAT(last->out(), HasSubstr("held: omega "));
  const std::string out = last->out();
  EXPECT_GT(out.find('\n'), 80U) << out;
}

}  // namespace
}  // namespace emtb
