#include "analysis/investigate/investigate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <span>

#include "hal/error.h"
#include "model/catalogue.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using testing::Contains;
using testing::Each;
using testing::ElementsAre;
using testing::EndsWith;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Le;
using testing::SizeIs;

/// The plant of the blind test as a bench to investigate: keeps what it was asked and what it ran, fails on request.
class BlindBench : public ExperimentBench {
 public:
  BlindBench() : plant(blind::fast_bench()) {}

  Reach reach() const override { return {.low = low, .high = high, .limits = limits}; }
  bool measures(Signal signal) const override {
    return std::ranges::any_of(plant.channels, [=](const auto& c) { return c.signal == signal; });
  }
  bool stop_wanted() const override { return made.size() >= stop_after; }

  bool agrees(const PlannedRuns& plan) override {
    asked.push_back(plan.why);
    return asked.size() <= agree_to;
  }

  Recording run(const Profile& profile, const std::string&) override {
    if (made.size() >= fault_after) throw Error("overspeed");
    made.push_back(profile.name());
    levels.push_back(std::max(std::abs(profile.min()), std::abs(profile.max())));
    return {profile.name() + ".h5", {record(plant, profile, made.size())}};
  }

  static constexpr std::size_t never = std::numeric_limits<std::size_t>::max();
  blind::Bench plant;
  double low = -5, high = 5;                                     // [V]
  SignalLimits limits{{Signal::i_a, 19}, {Signal::omega, 620}};  // [A], [rad/s]: what its channels can read
  std::size_t stop_after = never, fault_after = never, agree_to = never;

  std::vector<PlannedRuns::Why> asked;
  std::vector<std::string> made;
  std::vector<double> levels;  // [V] the largest of each run
};

/// Keeps what it was told.
class Notes : public InvestigationListener {
 public:
  explicit Notes(const BlindBench& bench) : bench_(bench) {}
  void diagnosed(int, const InvestigationRound& round, const Diagnosis&) override { verdicts.push_back(round.verdict); }
  void made_smaller(const Profile& profile) override { smaller.push_back(profile.name()); }
  std::string foretold(const Model&, const Profile&) override {
    runs_before_it_was_foretold = bench_.made.size();
    return "kept.csv";
  }

  std::vector<Verdict> verdicts;
  std::vector<std::string> smaller;
  std::size_t runs_before_it_was_foretold = 0;

 private:
  const BlindBench& bench_;
};

class Investigate : public testing::Test {
 protected:
  Investigate() {
    bench.plant.plant.friction = {.law = simulated::FrictionLaw::hard, .T_c = 0.003};  // [N m]
    options.settle = 1.5;
  }

  Recording turning(const std::string& name, const std::vector<double>& levels) {
    const emtb::Run whole = record(bench.plant, staircase(name, levels, 0.5, 1, 0.5), 99);
    emtb::Run part;
    part.name = name;
    for (const auto& [signal, series] : whole.signals) {
      Series& kept = part.signals[signal] = series;
      kept.t.clear(), kept.value.clear();
      for (std::size_t i = 0; i < series.t.size(); ++i) {
        if (series.t[i] < 1 || series.t[i] > 4.4) continue;  // [s] up to speed, and not yet down again
        kept.t.push_back(series.t[i] - 1), kept.value.push_back(series.value[i]);
      }
    }
    return {name + ".h5", {part}};
  }

  Investigation investigated(std::vector<Recording> train = {}, std::vector<Recording> held_out = {}) {
    return investigate(bench, bench.plant.model, std::move(train), std::move(held_out), options, notes);
  }

  /// Sessions of a motor that never comes to rest, and of nothing that would measure a load.
  Investigation investigated_in_one_direction() {
    std::erase_if(bench.plant.channels, [](const auto& c) { return c.signal == Signal::torque; });
    return investigated({turning("one", {2, 4, 1, 3})}, {turning("other", {3, 1, 4, 2})});
  }

  BlindBench bench;
  Notes notes{bench};
  InvestigateOptions options;
};

TEST_F(Investigate, FindsAHiddenFrictionAndForetellsARun) {
  const Investigation found = investigated();
  EXPECT_EQ(found.broken_off, "");
  ASSERT_TRUE(found.diagnosis);
  EXPECT_TRUE(found.decided());
  ASSERT_THAT(found.rounds, SizeIs(1));
  ASSERT_THAT(found.rounds[0].missing, SizeIs(1));
  EXPECT_EQ(found.rounds[0].missing[0].id, "coulomb_friction");
  EXPECT_THAT(found.rounds[0].missing[0].tied_with, IsEmpty());
  EXPECT_EQ(found.rounds[0].sessions, 4U);
  EXPECT_THAT(notes.verdicts, ElementsAre(Verdict::found));
  EXPECT_THAT(bench.asked, ElementsAre(PlannedRuns::Why::no_sessions, PlannedRuns::Why::to_be_foretold));
  EXPECT_THAT(bench.made, SizeIs(7));
  EXPECT_THAT(found.train, SizeIs(4));
  EXPECT_THAT(found.held_out, SizeIs(2)) << "the run that was foretold takes no part in the diagnosis";
  ASSERT_TRUE(found.foretold);
  EXPECT_EQ(notes.runs_before_it_was_foretold, 6U);
  EXPECT_EQ(found.foretold->prediction, "kept.csv");
  EXPECT_LT(found.foretold->final.chained_error, 1.15);
  EXPECT_GT(found.foretold->base.chained_error, 2);
}

TEST_F(Investigate, MovesNothingThatNobodyAgreedTo) {
  bench.agree_to = 0;
  const Investigation found = investigated();
  EXPECT_THAT(bench.made, IsEmpty());
  EXPECT_FALSE(found.diagnosis);
  EXPECT_FALSE(found.decided());
  EXPECT_EQ(found.broken_off, "");
}

TEST_F(Investigate, AFaultInTheFirstRunsEndsItWithNothingFound) {
  bench.fault_after = 3;
  const Investigation found = investigated();
  EXPECT_EQ(found.broken_off, "overspeed");
  EXPECT_THAT(bench.made, SizeIs(3)) << "none after the fault";
  EXPECT_FALSE(found.diagnosis);
}

TEST_F(Investigate, AFaultInALaterRunLeavesWhatWasFound) {
  bench.fault_after = 6;
  const Investigation found = investigated();
  EXPECT_EQ(found.broken_off, "overspeed");
  ASSERT_TRUE(found.diagnosis);
  EXPECT_TRUE(found.decided());
  EXPECT_EQ(found.rounds.back().missing[0].id, "coulomb_friction");
  EXPECT_THAT(found.train, SizeIs(4));
  EXPECT_FALSE(found.foretold);
}

TEST_F(Investigate, MakesNoRunOnceAStopIsWanted) {
  bench.stop_after = 2;
  const Investigation found = investigated();
  EXPECT_THAT(bench.made, SizeIs(2));
  EXPECT_THAT(found.broken_off, HasSubstr("stopped before the run"));
  EXPECT_FALSE(found.diagnosis);
}

TEST_F(Investigate, RunsWhatSeparatesTiedEffectsTwiceWithinTheReach) {
  options.rounds = 2;
  options.foretell = false;
  const Investigation found = investigated_in_one_direction();
  ASSERT_THAT(found.rounds, SizeIs(2));
  EXPECT_EQ(found.rounds[0].verdict, Verdict::tied) << "one that turns one way tells friction from no load";
  ASSERT_TRUE(found.rounds[0].then);
  EXPECT_EQ(found.rounds[0].then->why, PlannedRuns::Why::tied);
  ASSERT_TRUE(found.rounds[0].then->proposal);
  EXPECT_THAT(bench.made, ElementsAre(EndsWith("-fit"), EndsWith("-judge")));
  EXPECT_THAT(bench.levels, Each(Le(5)));
  EXPECT_EQ(found.rounds[1].verdict, Verdict::found);
  EXPECT_EQ(found.rounds[1].missing[0].id, "coulomb_friction");
  EXPECT_FALSE(found.rounds[1].then);
  EXPECT_THAT(found.train, ElementsAre("one.h5", EndsWith("-fit.h5")));
  EXPECT_THAT(found.held_out, ElementsAre("other.h5", EndsWith("-judge.h5")));
}

TEST_F(Investigate, MakesNoRunBeyondItsRounds) {
  options.rounds = 1;
  options.foretell = false;
  const Investigation found = investigated_in_one_direction();
  EXPECT_THAT(found.rounds, SizeIs(1));
  EXPECT_FALSE(found.decided());
  EXPECT_THAT(bench.asked, IsEmpty());
  EXPECT_THAT(bench.made, IsEmpty());
}

TEST_F(Investigate, MakesRunsSmallerThatWouldComeNearALimit) {
  bench.limits[Signal::i_a] = 12;  // [A]; 5 V would draw 4 * 5 / 1.2 = 16.7
  options.foretell = false;
  const Investigation found = investigated();
  EXPECT_EQ(found.broken_off, "");
  EXPECT_THAT(bench.made, SizeIs(6));
  EXPECT_THAT(notes.smaller, Contains("step_high"));
  EXPECT_LT(bench.levels[1], 12 * 1.2 / 4);
  EXPECT_TRUE(found.decided());
}

/// A friction of one speed that the library lacks, and somebody who finds a law for it.
class InvestigateALaw : public Investigate {
 protected:
  InvestigateALaw() {
    bench.plant.plant.friction = {};
    bench.plant.plant.hidden_torque = [](double omega, double, double) {
      return std::copysign(0.02 * std::exp(-std::pow((std::abs(omega) - 250) / 40, 2)), omega);
    };
    for (std::size_t effect = 0; effect < effect_count; ++effect) {  // a short search: none of them would explain it
      if (effect_catalogue()[effect].id != "coulomb_friction") bench.plant.model.withheld.push_back(effect);
    }
    options.foretell = false;
    options.discover = [](const Diagnosis& d, std::span<const emtb::Run>, std::span<const emtb::Run>) {
      auto found = std::make_unique<Discovery>();
      Law& law = found->law.emplace();
      law.text = {"bump_torque_of_omega", TermPlace::torque, "-a*tanh(omega/s)", {"omega"}, {}};
      law.at = {-450, 450};
      law.most_uncertain_at = {-300, 180};
      law.model = d.final;
      return found;
    };
  }
};

TEST_F(InvestigateALaw, RunsWhereItIsLeastSure) {
  const Investigation found = investigated();
  EXPECT_EQ(found.broken_off, "");
  ASSERT_THAT(bench.asked, Contains(PlannedRuns::Why::unsure_law));
  EXPECT_THAT(bench.made, Contains("law-fit"));
  EXPECT_THAT(bench.made, Contains("law-judge"));
  EXPECT_THAT(found.train, Contains("law-fit.h5"));
  EXPECT_THAT(found.held_out, Contains("law-judge.h5")) << "it judges, and takes no part in the fit";
  const auto round =
      std::ranges::find_if(found.rounds, [](const InvestigationRound& r) { return r.then && r.then->law; });
  ASSERT_NE(round, found.rounds.end());
  EXPECT_EQ(round->verdict, Verdict::unknown_effect);
  EXPECT_EQ(round->then->law->over, "omega");
  EXPECT_THAT(round->then->law->at, ElementsAre(-300, 180));
  EXPECT_LE(round->then->high(), bench.high);
  EXPECT_GE(round->then->low(), bench.low);
}

TEST_F(InvestigateALaw, RunsNothingForItThatNobodyAgreedTo) {
  bench.agree_to = 2;  // the first runs, and longer ones
  const Investigation found = investigated();
  ASSERT_THAT(bench.asked, Contains(PlannedRuns::Why::unsure_law));
  EXPECT_THAT(bench.made, testing::Not(Contains("law-fit")));
  ASSERT_TRUE(found.rest);
  EXPECT_TRUE(found.rest->law) << "what was found stands";
}

}  // namespace
}  // namespace emtb
