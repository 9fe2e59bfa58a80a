#include "config/profile.h"

#include <algorithm>
#include <vector>

#include "tests/config/complains.h"

namespace emtb {
namespace {

using ::testing::HasSubstr;

Profile profile(const std::string& text) { return read_profile(YamlMap::parse(text, "p.yaml")); }
std::string bad(const std::string& text) {
  return complaint([&] { profile(text); });
}

const std::string step_text = "name: s\nkind: step\nlevel: 6\nbefore: 1\nhold: 12\nafter: 12\n";

TEST(ProfileFile, Step) {
  const Profile s = profile(step_text + "rest: 0.5\n");
  EXPECT_EQ(s.name(), "s");
  EXPECT_DOUBLE_EQ(s.duration(), 25);
  EXPECT_DOUBLE_EQ(s.reference(0.5), 0.5);
  EXPECT_DOUBLE_EQ(s.reference(2), 6);
}

TEST(ProfileFile, Ramp) {
  const Profile r = profile("name: r\nkind: ramp\nlevel: 6\nrate: 0.5\nbefore: 1\nhold: 2\nafter: 3\n");
  EXPECT_DOUBLE_EQ(r.duration(), 1 + 12 + 2 + 12 + 3);
  EXPECT_DOUBLE_EQ(r.reference(7), 3);
}

TEST(ProfileFile, Staircase) {
  const Profile s = profile("name: s\nkind: staircase\nlevels: [2, -4]\nbefore: 1\nhold: 2\nafter: 3\n");
  EXPECT_DOUBLE_EQ(s.duration(), 8);
  EXPECT_DOUBLE_EQ(s.reference(4), -4);
}

TEST(ProfileFile, RandomSteps) {
  const Profile r = profile(
      "name: r\nkind: random_steps\nlow: 1\nhigh: 6\nshortest: 1\nlongest: 2\nbefore: 1\ntotal: 10\nafter: 1\nseed: "
      "7\n");
  EXPECT_NEAR(r.duration(), 12, 1e-9);
  const Profile same = random_steps("r", 1, 6, 1, 2, 1, 10, 1, 7);
  for (double t = 0; t < 12; t += 0.1) EXPECT_DOUBLE_EQ(r.reference(t), same.reference(t));
}

TEST(ProfileFile, EachMistakeHasItsLine) {
  EXPECT_EQ(bad(step_text + "levle: 6\n"),
            "p.yaml:7: levle is not known here. Known: name, kind, level, before, hold, after, rest");
  EXPECT_EQ(bad("name: s\nkind: step\nlevel: 6\nbefore: 1\nafter: 12\n"), "p.yaml:1: hold is missing");
  EXPECT_EQ(bad("name: s\nkind: sine\n"), "p.yaml:2: kind is `sine`. Known: step, ramp, staircase, random_steps, knots");
  EXPECT_EQ(bad("name: s\nkind: step\nlevel: six\nbefore: 1\nhold: 12\nafter: 12\n"),
            "p.yaml:3: level must be a number, not `six`");
  EXPECT_EQ(bad("name: s\nkind: step\nlevel: 6\nbefore: -1\nhold: 12\nafter: 12\n"),
            "p.yaml:4: before is -1, but must be 0 or more");
  EXPECT_EQ(bad("name: s\nkind: step\nlevel: 6\nbefore: 1\nhold: 0\nafter: 12\n"),
            "p.yaml:5: hold is 0, but must be above 0");
  EXPECT_EQ(bad("name: r\nkind: ramp\nlevel: 6\nrate: 0\nbefore: 1\nhold: 2\nafter: 3\n"),
            "p.yaml:4: rate is 0, but must be above 0");
  EXPECT_THAT(bad("name: s\nkind: staircase\nlevels: []\nbefore: 1\nhold: 2\nafter: 3\n"),
              HasSubstr("p.yaml:3: levels is empty"));
  EXPECT_EQ(bad(step_text + "name: t\n"), "p.yaml:7: name stands twice. Keep one");
}

TEST(ProfileFile, RandomStepsMistakes) {
  const auto with = [](const std::string& range, const std::string& times, const std::string& seed) {
    return bad("name: r\nkind: random_steps\nbefore: 1\nafter: 1\n" + range + times + seed);
  };
  const std::string range = "low: 0\nhigh: 6\n";
  const std::string times = "shortest: 1\nlongest: 2\ntotal: 9\n";
  EXPECT_EQ(with(range, times, "seed: 1\n"), "");
  EXPECT_EQ(with("low: 6\nhigh: 0\n", times, "seed: 1\n"), "p.yaml:6: high is 0, but must be 6 or more");
  EXPECT_EQ(with(range, "shortest: 3\nlongest: 2\ntotal: 9\n", "seed: 1\n"),
            "p.yaml:8: longest is 2, but must be 3 or more");
  EXPECT_EQ(with(range, "shortest: 0\nlongest: 2\ntotal: 9\n", "seed: 1\n"),
            "p.yaml:7: shortest is 0, but must be 0.001 or more");
  EXPECT_THAT(with(range, "shortest: 0.001\nlongest: 2\ntotal: 1e6\n", "seed: 1\n"),
              HasSubstr("p.yaml:9: total is 1e+06, but must be 0 to 100"));
  EXPECT_EQ(with(range, times, "seed: 1.5\n"), "p.yaml:10: seed must be a whole number");
  EXPECT_THAT(with(range, times, "seed: -1\n"), HasSubstr("p.yaml:10: seed is -1, but must be 0 to"));
}

TEST(ProfileFile, ANameCannotLeaveItsFolder) {
  EXPECT_THAT(bad("name: ../x\nkind: step\n"), HasSubstr("p.yaml:1: name is `../x`, but may only have"));
  EXPECT_THAT(bad("name: ''\nkind: step\n"), HasSubstr("name is ``"));
}

TEST(ShippedProfiles, AllReadAndFitTheirBench) {
  double total = 0;
  int count = 0;
  for (const auto& entry : std::filesystem::directory_iterator(EMTB_SOURCE_DIR "/config/profiles")) {
    const Profile p = read_profile(entry.path());
    EXPECT_EQ(p.name(), entry.path().stem());
    EXPECT_LE(p.max(), 6) << p.name();
    const bool fh2 = p.name().starts_with("fh2_");
    EXPECT_GE(p.min(), fh2 ? 0 : -6) << p.name();
    EXPECT_LE(p.duration(), 60) << p.name();
    if (fh2) total += p.duration();
    if (!fh2) {  // a larger jump draws more than the current that desk-simulated.yaml allows
      const auto knots = p.knots();
      for (std::size_t i = 1; i < knots.size(); ++i) {
        if (knots[i].t == knots[i - 1].t) {
          EXPECT_LE(std::abs(knots[i].value - knots[i - 1].value), 6) << p.name();
        }
      }
    }
    ++count;
  }
  EXPECT_EQ(count, 12);
  EXPECT_LE(total, 250);
}

}  // namespace
}  // namespace emtb
