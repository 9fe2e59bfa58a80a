#include "config/profile.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <vector>

#include "config/bench.h"
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

TEST(ProfileFile, CoastDownDropsTheReferenceAtOnce) {
  const Profile c = profile("name: c\nkind: coast_down\nlevel: 6\nrate: 2\nbefore: 1\nhold: 2\nafter: 9\n");
  EXPECT_DOUBLE_EQ(c.duration(), 1 + 3 + 2 + 9);
  EXPECT_DOUBLE_EQ(c.reference(2.5), 3);
  EXPECT_DOUBLE_EQ(c.reference(5.999), 6);
  EXPECT_DOUBLE_EQ(c.reference(6), 0);
}

TEST(ProfileFile, ReversalGoesToAndFro) {
  const Profile r = profile("name: r\nkind: reversal\nlevel: 3\ntimes: 2\nbefore: 1\nhold: 2\nafter: 1\n");
  EXPECT_DOUBLE_EQ(r.duration(), 1 + 3 * 2 + 1);
  EXPECT_DOUBLE_EQ(r.reference(2), 3);
  EXPECT_DOUBLE_EQ(r.reference(4), -3);
  EXPECT_DOUBLE_EQ(r.reference(6), 3);
}

TEST(ProfileFile, ChirpIsASineWhoseFrequencyGrows) {
  const Profile c =
      profile("name: c\nkind: chirp\noffset: 3\namplitude: 1\nf0: 0.1\nf1: 5\nbefore: 1\ntotal: 30\nafter: 1\n");
  EXPECT_DOUBLE_EQ(c.duration(), 32);
  EXPECT_EQ(c.min(), 0) << "the rest";
  EXPECT_NEAR(c.max(), 4, 0.01);
  // phi(t) = 2 pi f0 T / ln(f1/f0) (exp(ln(f1/f0) t/T) - 1)
  const double growth = std::log(50.0);
  const auto sine = [&](double t) { return 3 + std::sin(2 * M_PI * 0.1 * 30 / growth * std::expm1(growth * t / 30)); };
  for (double t = 0; t < 30; t += 0.0137) EXPECT_NEAR(c.reference(1 + t), sine(t), 0.004) << t;
  EXPECT_THAT(bad("name: c\nkind: chirp\noffset: 3\namplitude: 1\nf0: 50\nf1: 50\nbefore: 1\ntotal: 3000\nafter: 1\n"),
              HasSubstr("150000 periods"));
}

TEST(ProfileFile, HeatSoakDipsEverySoOften) {
  const Profile h =
      profile("name: h\nkind: heat_soak\nlevel: 5\nlow: 2\nevery: 60\ndip: 5\nbefore: 1\ntotal: 200\nafter: 2\n");
  EXPECT_DOUBLE_EQ(h.duration(), 203);
  EXPECT_DOUBLE_EQ(h.reference(30), 5);
  EXPECT_DOUBLE_EQ(h.reference(63), 2);
  EXPECT_DOUBLE_EQ(h.reference(67), 5);
  EXPECT_DOUBLE_EQ(h.reference(128), 2);
  EXPECT_DOUBLE_EQ(h.reference(202), 0);
}

TEST(ProfileFile, FromCsvHoldsEachValueOrDrawsALine) {
  const auto folder = std::filesystem::temp_directory_path() / ("emtb_from_csv_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "u.csv") << "t_s,u_ref_V\n0,0\n1,2\n2,2\n3,4\n4,0\n";
  std::ofstream(folder / "held.yaml") << "name: h\nkind: from_csv\nfile: u.csv\n";
  std::ofstream(folder / "line.yaml") << "name: l\nkind: from_csv\nfile: u.csv\nline: true\n"
                                      << "needs: {at_rest: true}\npauses: [{at: 1, say: look}]\n";
  const Profile h = read_profile(folder / "held.yaml");
  const Profile l = read_profile(folder / "line.yaml");
  EXPECT_DOUBLE_EQ(h.reference(0.9), 0);
  EXPECT_DOUBLE_EQ(h.reference(2.9), 2);
  EXPECT_DOUBLE_EQ(h.reference(3), 4);
  EXPECT_DOUBLE_EQ(l.reference(0.5), 1);
  const Experiment sent = read_experiment(YamlMap::parse(self_contained(YamlMap::load(folder / "line.yaml")), "sent"));
  EXPECT_DOUBLE_EQ(sent.profile.reference(3.5), 2);
  EXPECT_TRUE(sent.needs.at_rest);
  ASSERT_EQ(sent.pauses.size(), 1u);
  EXPECT_EQ(sent.pauses[0].say, "look");
  std::filesystem::remove_all(folder);
}

TEST(ProfileFile, TellsWhatItNeedsAndWhereItWaits) {
  const Experiment e = read_experiment(
      YamlMap::parse(step_text + "needs: {at_rest: true, field: true, idle: 20, temperature: 30}\n"
                                 "pauses: [{at: 1, say: set the brake, within: 120}, {at: 13, say: release it}]\n",
                     "p.yaml"));
  EXPECT_TRUE(e.needs.at_rest);
  EXPECT_TRUE(e.needs.field);
  EXPECT_EQ(e.needs.idle, 20);
  EXPECT_EQ(e.needs.temperature, 30);
  ASSERT_EQ(e.pauses.size(), 2u);
  EXPECT_EQ(e.pauses[0].say, "set the brake");
  EXPECT_DOUBLE_EQ(e.longest(), 25 + 120 + 60);
  const Experiment hostile = read_experiment(
      YamlMap::parse(step_text + R"(pauses: [{at: 1, say: "done\n\e[2Jemtb: press Enter"}])", "p.yaml"));
  EXPECT_EQ(hostile.pauses[0].say, "done??[2Jemtb: press Enter") << "it is printed for whoever runs it";
  const auto wrong = [](const std::string& more) {
    return complaint([&] { read_experiment(YamlMap::parse(step_text + more, "p.yaml")); });
  };
  EXPECT_THAT(wrong("needs: {rest: true}\n"), HasSubstr("p.yaml:7: needs.rest is not known here"));
  EXPECT_THAT(wrong("pauses: [{at: 26, say: x}]\n"), HasSubstr("at is 26"));
  EXPECT_THAT(wrong("pauses: [{at: 2, say: x}, {at: 1, say: y}]\n"), HasSubstr("at is 1"));
}

TEST(ProfileFile, EachMistakeHasItsLine) {
  EXPECT_EQ(bad(step_text + "levle: 6\n"),
            "p.yaml:7: levle is not known here. Known: name, kind, level, before, hold, after, rest, needs, pauses");
  EXPECT_EQ(bad("name: s\nkind: step\nlevel: 6\nbefore: 1\nafter: 12\n"), "p.yaml:1: hold is missing");
  EXPECT_EQ(bad("name: s\nkind: from_csv\nfile: \"u\\b.csv\"\n"), "p.yaml:3: file holds a control character");
  EXPECT_EQ(bad("name: s\nkind: sine\n"),
            "p.yaml:2: kind is `sine`. Known: step, ramp, staircase, random_steps, knots, coast_down, reversal, chirp, "
            "heat_soak, from_csv");
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
  const BenchConfig fh2 = read_bench(EMTB_SOURCE_DIR "/config/benches/fh2-simulated.yaml");
  const BenchConfig desk = read_bench(EMTB_SOURCE_DIR "/config/benches/desk-simulated.yaml");
  for (const auto& entry : std::filesystem::directory_iterator(EMTB_SOURCE_DIR "/config/profiles")) {
    if (entry.path().extension() != ".yaml") continue;  // what a from_csv names
    const Experiment e = read_experiment(entry.path());
    const Profile& p = e.profile;
    EXPECT_EQ(p.name(), entry.path().stem());
    const bool on_fh2 = p.name().starts_with("fh2_");
    ASSERT_TRUE(on_fh2 || p.name().starts_with("desk_")) << p.name();
    const BenchConfig& bench = on_fh2 ? fh2 : desk;
    EXPECT_LE(p.max(), bench.reference.limits.max) << p.name();
    EXPECT_GE(p.min(), bench.reference.limits.min) << p.name();
    EXPECT_LE(e.longest(), bench.limits.time) << p.name();
    if (on_fh2) continue;  // its driver ramps
    const auto knots = p.knots();
    for (std::size_t i = 1; i < knots.size(); ++i) {
      if (knots[i].t == knots[i - 1].t) {
        EXPECT_LE(std::abs(knots[i].value - knots[i - 1].value), 6) << p.name() << ": more current than allowed";
      }
    }
  }
}

TEST(ShippedProfiles, HaveOneOfEachKindThatTheBenchCanDo) {
  std::map<std::string, std::set<std::string>> kinds;  // of each bench
  for (const auto& entry : std::filesystem::directory_iterator(EMTB_SOURCE_DIR "/config/profiles")) {
    if (entry.path().extension() != ".yaml") continue;
    const std::string name = entry.path().stem();
    kinds[name.substr(0, name.find('_'))].insert(YamlMap::load(entry.path()).text("kind"));
  }
  const std::set<std::string> all{"step",       "ramp",      "staircase", "random_steps",
                                  "coast_down", "heat_soak", "chirp",     "from_csv"};
  EXPECT_EQ(kinds["fh2"], all) << "its driver has one direction";
  auto both_directions = all;
  both_directions.insert("reversal");
  EXPECT_EQ(kinds["desk"], both_directions);
}

}  // namespace
}  // namespace emtb
