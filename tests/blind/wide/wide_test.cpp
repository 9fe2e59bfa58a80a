#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>

#include "config/model.h"
#include "hal/error.h"
#include "session/spec.h"
#include "tests/blind/wide/asking.h"
#include "tests/blind/wide/logger.h"
#include "tests/blind/wide/oracle.h"
#include "tests/blind/wide/visibility.h"
#include "tests/blind/wide/wide_table.h"

namespace emtb::blind::wide {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

/// A folder of the test's own, gone when the test is.
class TemporaryFolder {
 public:
  TemporaryFolder() : path_(std::filesystem::path(testing::TempDir()) / ("emtb_wide_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// The draw

TEST(WideDraw, ACaseIsTheSameWhateverElseIsDrawn) {
  const WideCase alone = make_wide_case(Kind::single, 5, 3);
  make_wide_case(Kind::single, 4, 3);
  const WideCase again = make_wide_case(Kind::single, 5, 3);
  EXPECT_EQ(alone.seed, again.seed);
  EXPECT_EQ(truth_text(alone), truth_text(again));
  ASSERT_EQ(alone.train.size(), again.train.size());
  for (const auto& [signal, series] : alone.train.front().signals) {
    EXPECT_EQ(series.value, again.train.front().at(signal).value) << info(signal).name;
  }
  EXPECT_NE(make_wide_case(Kind::single, 5, 4).seed, alone.seed);
}

TEST(WideDraw, SeesAllThatPeopleBring) {
  std::map<std::string, std::set<std::string>> seen;
  for (std::uint64_t seed = 0; seed < 400; ++seed) {
    Draw draw(seed);
    const WideBench b = draw_bench(draw);
    for (const auto& [trait, value] : b.traits) seen[trait].insert(value);
    EXPECT_GE(1 / b.period, 20 - 1e-9);
    EXPECT_LE(1 / b.period, 20e3 + 1e-6);
    EXPECT_GE(b.machine.tau / b.period, 2.5) << "rows that no longer follow the motor";
    double rows = 0;
    for (const auto* list : {&b.train, &b.held_out}) {
      for (const Experiment& e : *list) rows += e.target.duration() / b.period;
    }
    EXPECT_LE(rows * static_cast<double>(b.instruments.size() + 1), 60'000) << seed;
    EXPECT_GE(b.train.size(), 1u);
    EXPECT_LE(b.train.size() + b.held_out.size(), 12u);
  }
  EXPECT_EQ(seen["machine"].size(), 5u);
  EXPECT_THAT(seen["speed"], testing::UnorderedElementsAre("tacho", "encoder", "both", "counted speed"));
  EXPECT_THAT(seen["loop"], testing::UnorderedElementsAre("open", "speed", "position"));
  EXPECT_THAT(seen["read"], testing::UnorderedElementsAre("before", "after"));
  EXPECT_THAT(seen["current"], testing::UnorderedElementsAre("yes", "no", "slow meter"));
  EXPECT_THAT(seen["scale"], testing::UnorderedElementsAre("fixed by the current", "R_a known", "free"));
  EXPECT_THAT(seen["start"], testing::UnorderedElementsAre("at rest", "on the way"));
  EXPECT_EQ(seen["rate"].size(), 3u);
  EXPECT_EQ(seen["runs"].size(), 3u);
  for (const char* trait : {"bounds", "file", "model error", "noise", "jitter", "hold", "sensor delay", "ways", "laws",
                            "e_a", "gauge", "input", "driver"}) {
    EXPECT_EQ(seen[trait].size(), 2u) << trait;
  }
}

TEST(WideDraw, KnowsAllEffectsOfTheContract) {
  std::vector<std::string_view> ids;
  for (const WideEffect& e : wide_effects()) ids.push_back(e.id);
  for (const Hidden& h : everything_hidden()) {
    if (h.outside) continue;
    EXPECT_THAT(ids, Contains(h.id));
  }
}

// The logger

/// A motor of 1 V s/rad, 2 ohm and tau = 0.2 s under a step of 10 V at 0.5 s, logged at 100 Hz without noise.
WideBench plain_bench() {
  WideBench b;
  b.machine = {
      .kind = "plain", .R = 2, .K = 1, .J = 0.1, .voltage = 20, .speed = 20, .current = 1, .torque = 1, .tau = 0.2};
  b.plant.motor = {.R_a = 2, .K_b = 1, .K_m = 1, .B = 1e-3, .J = 0.1};
  b.plant.driver = {.gain = 1, .min = -20, .max = 20};
  b.period = 0.01;
  b.instruments = {{.signal = Signal::i_a}, {.signal = Signal::omega}};
  return b;
}

Experiment step_at_half() { return {"step", Profile("step", {{0, 0}, {0.5, 0}, {0.5, 10}, {2, 10}}), 0}; }

TEST(WideLogger, ReadsTheRowOfAChangeBeforeOrAfterIt) {
  WideBench b = plain_bench();
  const auto before = record(b, step_at_half(), 1).run;
  b.read_after = true;
  const auto after = record(b, step_at_half(), 1).run;
  ASSERT_EQ(before.at(Signal::u_ref).value[50], 10);
  EXPECT_EQ(before.at(Signal::u_ref).value[49], 0);
  EXPECT_NEAR(before.at(Signal::i_a).value[50], 0, 1e-9);
  EXPECT_NEAR(after.at(Signal::i_a).value[50], 5, 1e-3) << "10 V over 2 ohm, at once";
  EXPECT_NEAR(before.at(Signal::i_a).value[51], after.at(Signal::i_a).value[51], 1e-3);
}

TEST(WideLogger, CountsDownToWholeStepsOfTheAngle) {
  WideBench b = plain_bench();
  b.encoder = {.as = EncoderAs::angle, .step = 0.1};
  const auto coarse = record(b, step_at_half(), 1).run;
  b.encoder.step = 1e-9;
  const auto fine = record(b, step_at_half(), 1).run;
  const auto &counts = coarse.at(Signal::theta).value, &exact = fine.at(Signal::theta).value;
  ASSERT_GT(exact.back(), 5);
  for (std::size_t k = 0; k < counts.size(); ++k) {
    EXPECT_NEAR(counts[k] / 0.1, std::round(counts[k] / 0.1), 1e-6);
    EXPECT_NEAR(counts[k], exact[k], 0.1 + 1e-9);
  }
  EXPECT_EQ(coarse.at(Signal::theta).lsb, 0.1);
}

TEST(WideLogger, ACountedSpeedIsTheDifferenceOfTwoCounts) {
  WideBench b = plain_bench();
  std::erase_if(b.instruments, [](const Instrument& i) { return i.signal == Signal::omega; });
  b.encoder = {.as = EncoderAs::speed, .step = 0.01};
  const auto run = record(b, step_at_half(), 1).run;
  const auto& omega = run.at(Signal::omega).value;
  for (const double v : omega) EXPECT_NEAR(v, std::round(v), 1e-6) << "0.01 rad in 0.01 s";
  EXPECT_NEAR(omega.back(), 10, 1.01);
}

TEST(WideLogger, HoldsAReadingForAsManyRowsAsItSays) {
  WideBench b = plain_bench();
  b.find(Signal::omega)->hold = 3;
  const auto held = record(b, step_at_half(), 1).run.at(Signal::omega).value;
  b.find(Signal::omega)->hold = 1;
  const auto all = record(b, step_at_half(), 1).run.at(Signal::omega).value;
  for (std::size_t k = 0; k < held.size(); ++k) EXPECT_EQ(held[k], all[k - k % 3]);
}

TEST(WideLogger, ADelayedSensorShowsWhatWas) {
  WideBench b = plain_bench();
  const auto now = record(b, step_at_half(), 1).run.at(Signal::omega).value;
  b.find(Signal::omega)->delay = 2 * b.period;
  const auto late = record(b, step_at_half(), 1).run.at(Signal::omega).value;
  for (std::size_t k = 60; k < late.size(); ++k) EXPECT_NEAR(late[k], now[k - 2], 1e-3);
}

TEST(WideLogger, JitterMovesTheReadingsAndTheLogHasTheRealTimes) {
  WideBench b = plain_bench();
  b.jitter = 0.2;
  const auto run = record(b, step_at_half(), 1).run;
  const Series& s = run.at(Signal::omega);
  double farthest = 0;
  for (std::size_t k = 1; k < s.t.size(); ++k) {
    EXPECT_GT(s.t[k], s.t[k - 1]);
    farthest = std::max(farthest, std::abs(s.t[k] - s.t[k - 1] - b.period));
  }
  EXPECT_GT(farthest, 0.1 * b.period);
  EXPECT_LE(farthest, 0.4 * b.period + 2e-6);
}

TEST(WideLogger, ALogThatBeginsOnTheWayBeginsAtZeroWithAShaftThatTurns) {
  Experiment late = step_at_half();
  late.begin = 0.6;
  const auto run = record(plain_bench(), late, 1).run;
  EXPECT_EQ(run.at(Signal::omega).t.front(), 0);
  EXPECT_GT(run.at(Signal::omega).value.front(), 2);
  EXPECT_LT(run.at(Signal::omega).value.front(), 6);
}

TEST(WideLogger, ASlowMeterLeavesCellsEmptyAndReadsMeans) {
  WideBench b = plain_bench();
  b.find(Signal::i_a)->period = 0.5;
  const auto run = record(b, step_at_half(), 1).run;
  const Series& meter = run.at(Signal::i_a);
  ASSERT_EQ(meter.value.size(), 4u);
  EXPECT_NEAR(meter.t[1], 1, 1e-6);
  // 5 exp(-t/tau) A over half a second, tau = 0.2 s: nearly all of its 1 A s.
  EXPECT_NEAR(meter.value[1], 5 * 0.2 * (1 - std::exp(-2.5)) / 0.5, 0.02);
}

TEST(WideLogger, AClosedLoopReachesItsTarget) {
  WideBench b = plain_bench();
  b.loop = Loop::speed;
  const auto run = record(b, step_at_half(), 1).run;
  EXPECT_NEAR(run.at(Signal::omega).value.back(), 10, 0.1);
  b.loop = Loop::position;
  b.encoder = {.as = EncoderAs::angle, .step = 1e-3};
  EXPECT_NEAR(record(b, step_at_half(), 1).run.at(Signal::theta).value.back(), 10, 0.2);
}

TEST(WideLogger, TheModelErrorIsAnotherInEachRunAndNoneWhereThereIsNone) {
  WideBench b = plain_bench();
  const auto omega = [&](std::uint64_t seed) { return record(b, step_at_half(), seed).run.at(Signal::omega).value; };
  EXPECT_EQ(omega(1), omega(2));
  b.model_error = 0.1;
  b.model_error_time = 0.3;
  EXPECT_EQ(omega(1), omega(1));
  EXPECT_NE(omega(1), omega(2));
}

// Sizes

WideBench bench_with_experiments() {
  WideBench b = plain_bench();
  b.train = {step_at_half()};
  b.held_out = {{"other", Profile("other", {{0, 0}, {0.2, 0}, {0.2, -6}, {1, -6}, {1, 3}, {2, 3}}), 0}};
  for (Instrument& i : b.instruments) i.noise = 0.01;
  return b;
}

TEST(WideVisibility, WhatAFitOfTheModelImitatesDoesNotShow) {
  const WideBench b = bench_with_experiments();
  const Visibility visibility(b, 1);
  WideBench other = b;
  EXPECT_EQ(visibility.of(other), 0);
  other.plant.motor.J *= 1.05;
  other.plant.motor.R_a *= 0.96;
  EXPECT_LT(visibility.of(other), 0.2);
}

TEST(WideVisibility, AFrictionShowsTheMoreTheLargerItIs) {
  const WideBench b = bench_with_experiments();
  const Visibility visibility(b, 1);
  const auto at = [&](double size) {
    WideBench other = b;
    wide_effect("coulomb_friction").hide(other, size, Draw(1));
    return visibility.of(other);
  };
  EXPECT_GT(at(5), 1);
  EXPECT_NEAR(at(5) / at(2.5), 2, 0.5);
}

// The files

TEST(WideFiles, AreWhatAUserHasAndTheTruthStandsBeside) {
  const TemporaryFolder folder;
  const WideCase c = make_wide_case(Kind::single, 1, 3);
  const CaseFiles files = write_case(c, folder.path());
  const Model model = read_model(folder.path() / files.model);
  for (const auto& [symbol, truth] : true_base(c)) {
    const auto p = std::ranges::find(model.base, symbol, &Parameter::symbol);
    ASSERT_NE(p, model.base.end());
    EXPECT_LT(p->min, truth);
    EXPECT_GT(p->max, truth);
  }
  EXPECT_EQ(files.train.size(), c.train.size());
  EXPECT_THAT(files.arguments(), Not(Contains(files.secret.front())));
  for (std::size_t n = 0; n < c.train.size(); ++n) {
    const auto run = read_session(folder.path() / files.train[n]).runs.front();
    for (const auto& [signal, series] : c.train[n].signals) {
      ASSERT_EQ(run.at(signal).value.size(), series.value.size()) << info(signal).name;
      EXPECT_NEAR(run.at(signal).value.back(), series.value.back(), 1e-6 * std::abs(series.value.back()) + 1e-12);
    }
  }
  std::ifstream in(folder.path() / "truth.json");
  std::stringstream truth;
  truth << in.rdbuf();
  EXPECT_THAT(truth.str(), HasSubstr(c.truths.front().id));
  EXPECT_EQ(write_case(c, folder.path()).checksum, files.checksum);
}

// Garbage

TEST(WideGarbage, IsOfTheContractsKindsAndSaysWhetherAnythingContradictsIt) {
  std::set<std::string> planted;
  bool open_question = false;
  for (std::size_t n = 0; n < 40; ++n) {
    const WideCase c = make_wide_case(Kind::garbage, n, 1);
    ASSERT_TRUE(c.garbage);
    planted.insert(c.garbage->what);
    if (c.garbage->contradicted) continue;
    open_question = true;
    EXPECT_EQ(c.garbage->what, "scale");
    EXPECT_GT(c.bench.bounds, 9) << "tight bounds contradict a wrong unit";
  }
  EXPECT_THAT(planted, testing::UnorderedElementsAre("scale", "sign", "clipped", "held", "spikes", "gap", "duplicate"));
  EXPECT_TRUE(open_question);
}

// Asking and counting

/// A program that answers as a script says.
std::filesystem::path program(const std::filesystem::path& folder, const std::string& script) {
  const auto path = folder / "program";
  std::ofstream(path) << "#!/bin/sh\n" << script;
  std::filesystem::permissions(path, std::filesystem::perms::owner_all);
  return path;
}

constexpr const char* answers_windage = R"(
if [ "$1" = check ]; then exit 2; fi
cat > diagnosis.json <<'END'
{"verdict": "found", "missing": [{"id": "windage", "tied_with": [], "parameters": {}}],
 "error": {"base": {"train": 3, "held_out": 4}, "final": {"train": 1, "held_out": null}},
 "parameters": {"R_a": {"value": 1, "std_error": 0.1, "unit": "ohm", "pinned": true},
                "K_b": {"value": 2, "std_error": 0.1, "unit": "V s/rad"}, "B": {"value": 0, "std_error": null}}}
END
)";

TEST(WideAsking, ReadsTheContractsKeysAndLeavesPinnedParametersOut) {
  const TemporaryFolder folder;
  const WideCase c = make_wide_case(Kind::healthy, 0, 3);
  const WideAnswer a =
      ask(c, write_case(c, folder.path() / "case"), {.emtb = program(folder.path(), answers_windage), .longest = 20});
  EXPECT_EQ(a.verdict, "found");
  EXPECT_EQ(a.unexplained, 1) << "a single run: the training error stands for the other";
  ASSERT_EQ(a.base_intervals.size(), 1u);
  EXPECT_EQ(a.base_intervals.front().name, "K_b");
  EXPECT_FALSE(a.findings) << "there is no check";
  EXPECT_THAT(grade(a).wrong, ElementsAre("windage"));
}

TEST(WideAsking, GarbageIsSkippedVisiblyWhereThereIsNoCheckAndCountedWhereThereIs) {
  const TemporaryFolder folder;
  WideCase c = make_wide_case(Kind::garbage, 0, 3);
  const CaseFiles files = write_case(c, folder.path() / "case");
  const WideAnswer skipped = ask(c, files, {.emtb = program(folder.path(), "exit 2\n"), .longest = 20});
  EXPECT_THAT(skipped.verdict, HasSubstr("skipped"));
  EXPECT_EQ(wide_score(std::vector{skipped}).unchecked, 1u);
  const std::string finding =
      "echo usage: emtb check\n[ \"$2\" = --help ] && exit 0\n"
      "echo '{\"findings\": [{\"what\": \"" +
      c.garbage->what + "\", \"signal\": \"i_a\", \"run\": \"a\"}]}' > check.json\n";
  const WideAnswer caught = ask(c, files, {.emtb = program(folder.path(), finding), .longest = 20});
  c.garbage->contradicted = true;
  ASSERT_TRUE(caught.findings);
  EXPECT_THAT(*caught.findings, ElementsAre(c.garbage->what + " i_a a"));
  EXPECT_THAT(false_findings(caught), IsEmpty());
}

TEST(WideAsking, ADiagnosisThatFailsOrLastsTooLongIsAnAnswer) {
  const TemporaryFolder folder;
  const WideCase c = make_wide_case(Kind::healthy, 0, 3);
  const CaseFiles files = write_case(c, folder.path() / "case");
  const WideAnswer died = ask(c, files, {.emtb = program(folder.path(), "echo why >&2; exit 2\n"), .longest = 20});
  EXPECT_EQ(died.verdict, "failed: exit 2, why");
  const auto slow = program(folder.path(), "[ \"$1\" = check ] && exit 2\nexec sleep 30\n");
  EXPECT_THAT(ask(c, files, {.emtb = slow, .longest = 0.3}).verdict, HasSubstr("in time"));
}

// The oracle

TEST(WideOracle, SaysWhetherTheDataTellTheTruthFromWhatWasNamed) {
  const TemporaryFolder folder;
  WideCase c;
  c.bench = bench_with_experiments();
  c.bench.secret = c.bench.held_out;
  c.about = {wide_effect("coulomb_friction").hide(c.bench, 3, Draw(1))};
  c.truths = {{"coulomb_friction", 3, c.about.front(), {"coulomb_friction"}}};
  std::uint64_t seed = 1;
  for (const Experiment& e : c.bench.train) c.train.push_back(record(c.bench, e, seed++).run);
  for (const Experiment& e : c.bench.held_out) c.held_out.push_back(record(c.bench, e, seed++).run);
  c.secret = {c.held_out.front()};
  c.secret.front().name = "secret";
  const CaseFiles files = write_case(c, folder.path());
  const Oracle over_nothing = ask_oracle(c, files, {});
  ASSERT_TRUE(over_nothing.nats) << over_nothing.why_not;
  EXPECT_GT(*over_nothing.nats, 3);
  EXPECT_GT(over_nothing.truth_error, 0.9);
  EXPECT_LT(over_nothing.truth_error, 1.6) << "what the instruments leave, and where the shaft stops within a row";
  EXPECT_EQ(over_nothing.rival, "nothing");
  const Oracle over_another = ask_oracle(c, files, {"coulomb_friction", "windage"});
  EXPECT_EQ(over_another.rival, "windage") << "no larger than the truth, and not the truth";
  EXPECT_GT(over_another.nats.value_or(0), 3);
  // A lag of 1 us is nothing that these rows could show.
  c.bench.plant.friction.T_c = 0;
  c.truths = {{"driver_lag", 1, {}, {"driver_lag"}}};
  c.about = {{{"tau", 1e-6}}};
  c.train = {record(c.bench, c.bench.train.front(), 1).run};
  c.held_out = c.secret = {record(c.bench, c.bench.held_out.front(), 2).run};
  const Oracle over_an_alias = ask_oracle(c, write_case(c, folder.path()), {"driver_delay"});
  ASSERT_TRUE(over_an_alias.nats) << over_an_alias.why_not;
  EXPECT_FALSE(over_an_alias.decidable());
  c.truths.front().id = "no_such_effect";
  EXPECT_THAT(ask_oracle(c, files, {}).why_not, HasSubstr("lacks no_such_effect"));
}

WideAnswer answer(const std::string& kind, std::vector<std::string> truth, std::vector<std::string> named) {
  WideAnswer a;
  a.id = kind + ":0";
  a.kind = kind;
  a.traits = {{"laws", "usual"}, {"loop", "open"}};
  for (const std::string& id : truth) a.right.push_back({id}), a.size.push_back(1);
  a.truth = std::move(truth);
  for (const std::string& id : named) a.missing.push_back({id, {}});
  a.verdict = a.missing.empty() ? "nothing_missing" : "found";
  return a;
}

TEST(WideAnswer, SurvivesItsLine) {
  WideAnswer a = answer("single", {"windage"}, {"eddy_brake"});
  a.nats = 2.5;
  a.findings = {"held i_a x"};
  a.intervals = {{"windage.c_w", 1, 2, 0.5}};
  a.secret = {{"omega", 1.25}};
  a.seed = 0xffffffffffffffffU;
  const WideAnswer b = wide_answer_from(to_json_line(a));
  EXPECT_EQ(to_json_line(a), to_json_line(b));
  EXPECT_EQ(b.seed, a.seed);
  EXPECT_THROW(wide_answer_from("{\"id\": 1"), Error);
}

TEST(WideScores, CountEachRowByItsOwnRule) {
  std::vector<WideAnswer> answers{answer("single", {"windage"}, {"windage"}),
                                  answer("single", {"windage"}, {"eddy_brake"}),
                                  answer("single", {"windage"}, {"eddy_brake"}),
                                  answer("healthy", {}, {}),
                                  answer("healthy", {}, {"windage"}),
                                  answer("outside", {"shaking"}, {"windage"}),
                                  answer("outside", {"shaking"}, {"windage"}),
                                  answer("outside", {"shaking"}, {}),
                                  answer("triple", {"a", "b", "c"}, {"a", "b"})};
  answers[0].intervals = {{"windage.c_w", 1, 1.1, 0.1}, {"windage.c_w", 1, 2, 0.1}};
  answers[1].nats = 20;   // the data tell
  answers[2].nats = 0.5;  // they do not
  answers[3].verdict = "unknown_effect";
  answers[6].verdict = "unknown_effect";
  const WideScores s = wide_score(answers);
  EXPECT_EQ(s.single.count, 1u);
  EXPECT_EQ(s.single.of, 2u);
  EXPECT_EQ(s.undecidable, 1u);
  EXPECT_EQ(s.healthy_named.count, 1u);
  EXPECT_EQ(s.healthy_unknown.count, 1u);
  EXPECT_EQ(s.outside_wrong.count, 1u);
  EXPECT_EQ(s.outside_silent.count, 1u);
  EXPECT_EQ(s.outside_wrong.of, 3u);
  EXPECT_EQ(s.triple.of, 1u);
  EXPECT_EQ(s.triple.count, 0u);
  EXPECT_EQ(s.covered.count, 1u);
  EXPECT_EQ(s.covered.of, 2u);
  EXPECT_THAT(wide_tables(answers), HasSubstr("| loop | open | 1 of 2 |"));
}

TEST(WideScores, WhereTheTrueStructureItselfIsFarOffTheLibraryHasNoExcuse) {
  WideAnswer a = answer("single", {"windage"}, {"eddy_brake"});
  a.traits["model error"] = "no";
  a.nats = -5;
  a.truth_error = 1.1;
  EXPECT_TRUE(undecidable(a));
  a.truth_error = 8;
  EXPECT_FALSE(undecidable(a));
  EXPECT_TRUE(missed(a));
  a.traits["laws"] = "other";
  EXPECT_TRUE(undecidable(a)) << "its law is not the plant's";
}

TEST(WideScores, AnEffectThatTheLibraryLacksIsCountedApart) {
  WideAnswer a = answer("single", {"bearing_drag"}, {"windage"});
  a.lacking = {"bearing_drag"};
  const WideScores s = wide_score(std::vector{a});
  EXPECT_EQ(s.single.of, 0u);
  EXPECT_EQ(s.lacking, 1u);
}

TEST(WideScores, RemarksAreNoFalseFindings) {
  WideAnswer a = answer("healthy", {}, {});
  a.findings = {"jitter omega a", "resolution theta a", "spikes i_a a"};
  EXPECT_THAT(false_findings(a), ElementsAre("spikes i_a a"));
  a.findings = {"held i_a a"};
  EXPECT_THAT(false_findings(a), ElementsAre("held i_a a"));
  a.traits["hold"] = "yes";
  EXPECT_THAT(false_findings(a), IsEmpty());
}

}  // namespace
}  // namespace emtb::blind::wide
