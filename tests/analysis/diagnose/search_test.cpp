// The search on made-up fits: what it keeps, swaps and drops, without a simulation.
#include "analysis/diagnose/search.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "model/catalogue.h"

namespace emtb {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;
using testing::UnorderedElementsAre;

using Effects = std::set<std::size_t>;

constexpr int readings = 1000;

/// A loss of so many floors in one signal.
Loss loss_of(double floors) {
  Record run;
  Observation o;
  o.signal = Signal::omega;
  Residuals r{0, Signal::omega, Eigen::VectorXd(readings), {}};
  for (int k = 0; k < readings; ++k) {
    run.excitation.t.push_back(1e-2 * k);
    o.first.push_back(static_cast<std::uint32_t>(k));
    o.last.push_back(static_cast<std::uint32_t>(k));
    o.value.push_back(0);
    o.sigma.push_back(1);
    r.value[k] = k % 2 == 0 ? floors : -floors;
  }
  run.observations.push_back(o);
  Loss loss({{Signal::omega, {.sigma = 1, .from = FloorSource::declared, .lower_bound = false, .autocorrelation = 0}}});
  loss.add(std::span(&run, 1), std::span(&r, 1));
  return loss;
}

/// Decides by the error alone.
class ByError final : public Criterion {
 public:
  bool material(const Loss& without, const Loss& with) const override { return with.error() < 0.9 * without.error(); }
  bool beyond_the_laws(const Loss& as_given, const Loss& without, const Loss& with) const override {
    return without.error() - with.error() > of_a_law * (as_given.error() - without.error());
  }
  bool material_beside_same_edges(const Loss&, const Loss& without, const Loss& with) const override {
    return edges_tell_two && material(without, with);
  }
  bool tied(const Loss& best, const Loss& other) const override {
    return std::abs(best.error() - other.error()) < 0.01 * best.error();
  }
  bool remainder(const Loss& loss) const override { return loss.error() > 1.1; }
  bool remainder_in(const Loss& loss, Signal) const override { return remainder(loss); }
  bool worth_a_wide_search(const Loss& loss) const override { return remainder(loss); }
  bool far_off(const Loss& loss) const override { return is_far_off && remainder(loss); }
  bool worth_trying_all(const Loss& loss) const override { return remainder(loss); }
  bool anything_left(const Loss& loss) const override { return loss.error() > 1.05; }

  bool is_far_off = true;
  double of_a_law = 0.01;
  bool edges_tell_two = true;
};

/// With sizes, as a fit leaves them.
void include(Model& model, std::size_t effect) {
  model.include(effect);
  const EffectInfo& about = model.about(effect);
  for (std::size_t i = 0; i < about.parameter_count; ++i)
    model.parameters_of(effect)[i].value = about.parameter_list[i].typical;
}

/// Fits whose errors stand in a table, by the effects that the model holds; what is not in it is as bad as nothing.
class MadeUp final : public Trials {
 public:
  std::map<Effects, double> errors;
  std::set<std::size_t> undetermined;
  std::set<Effects> implausible;         // together: none of them is determined in such a model
  std::set<std::size_t> unpromising;     // by their scores
  std::map<Effects, Effects> passed_by;  // the same, by those of a model
  std::set<std::size_t> slow;            // by their first steps
  std::map<Effects, double> lost;        // by its first fit: the error, in a valley that a later fit does not meet
  std::set<Effects> hidden;              // in such a valley from every fit but that from elsewhere
  std::map<Effects, Effects> pairs;      // what such a fit is given two effects for
  bool counts_parameters = false;        // a model's likelihood pays for them
  int most_refits = 1000, refitted = 0;  // rounds of them
  std::map<Effects, int> asked;          // for whole orders, and for two at once, beside these

  static Effects held_by(const Model& model) {
    Effects held;
    for (const IncludedEffect& e : model.effects) held.insert(e.effect);
    return held;
  }

  Trial trial(const Model& model) const {
    const auto error = errors.find(held_by(model));
    Trial fitted = trial(model, error != errors.end() ? error->second : errors.at({}));
    if (!counts_parameters) return fitted;
    const SignalSquares left{.squares = fitted.squares, .readings = readings, .interval = 1e-2};
    Quality& quality = fitted.held_out.quality.emplace();
    quality.training = quality.held_out = {{Signal::omega, left}};
    quality.memory = {{Signal::omega, 5e-3}};
    for (const IncludedEffect& e : model.effects)
      quality.free_parameters += static_cast<std::size_t>(std::ranges::count(e.parameters, false, &Parameter::fixed));
    return fitted;
  }

  static Trial trial(const Model& model, double floors) {
    return {.fit = {.model = model, .cost = 0.5 * readings * floors * floors},
            .squares = readings * floors * floors,
            .train = floors,
            .held_out = loss_of(floors)};
  }

  std::optional<Trial> fit(const Model& start, const Trial*) override {
    if (hidden.contains(held_by(start))) return trial(start, errors.at({}));
    const auto first = lost.find(held_by(start));
    if (first == lost.end()) return trial(start);
    const double floors = first->second;
    lost.erase(first);
    return trial(start, floors);
  }
  std::optional<Trial> fit_to_the_end(const Model& start) override { return trial(start); }
  std::optional<Trial> fit_from_elsewhere_too(const Model& start) override { return trial(start); }
  std::vector<Score> scores(const Trial&) override { return {}; }
  bool exhausted() override { return refitted >= most_refits; }
  Refits refits(const Trial& fitted, const std::vector<Score>&, Breadth breadth) override {
    ++refitted;
    Refits refits;
    for (std::size_t effect = 0; effect < effect_count; ++effect) {
      if (fitted.model().includes(effect) || fitted.model().withholds(effect)) continue;
      if (breadth == Breadth::promising && unpromising.contains(effect)) continue;
      const auto those = passed_by.find(held_by(fitted.model()));
      if (breadth == Breadth::promising && those != passed_by.end() && those->second.contains(effect)) continue;
      Model more = fitted.model();
      include(more, effect);
      Score score;
      score.effect = effect;
      if (slow.contains(effect)) {
        refits.broken_off.push_back({score, {.model = more}});
      } else {
        refits.done.push_back({score, trial(more)});
      }
    }
    return refits;
  }
  std::vector<Addition> go_on(const Trial&, const std::vector<Begun>& begun) override {
    std::vector<Addition> additions;
    for (const Begun& b : begun) additions.push_back({b.score, trial(b.fit.model)});
    return additions;
  }
  std::optional<Addition> refit_at_whole_orders(const Trial& fitted) override {
    ++asked[held_by(fitted.model())];
    return std::nullopt;
  }
  std::optional<Pair> refit_of_two(const Trial& fitted, const std::vector<Score>&,
                                   const std::vector<std::size_t>&) override {
    ++asked[held_by(fitted.model())];
    const auto two = pairs.find(held_by(fitted.model()));
    if (two == pairs.end() || fitted.train == errors.at(two->first)) return std::nullopt;
    Model more = fitted.model();
    for (const std::size_t effect : two->second) include(more, effect);
    return Pair{{*two->second.begin(), *two->second.rbegin()}, trial(more, 0.5 * fitted.train)};
  }
  bool determined(const Model& fitted, std::size_t effect) override {
    return !undetermined.contains(effect) && !implausible.contains(held_by(fitted));
  }
  bool can_be(const Model& fitted, std::size_t) override { return !implausible.contains(held_by(fitted)); }
  bool explains_most_runs(const Trial&) override { return false; }
};

class SearchOnMadeUpFits : public testing::Test {
 protected:
  const std::size_t dry = effect_index("coulomb_friction"), air = effect_index("windage"),
                    brush = effect_index("brush_drop"), coil = effect_index("armature_inductance"),
                    lag = effect_index("driver_lag");
  MadeUp trials;
  ByError criterion;
  std::vector<double> shares;

  Finding found() {
    Search search(trials, criterion, trials.trial({}), trials.trial({}).held_out, 6,
                  [this](double share, const std::string&) { shares.push_back(share); });
    return search.run();
  }
};

TEST_F(SearchOnMadeUpFits, KeepsNothingWhereNothingHelps) {
  trials.errors = {{{}, 1.5}, {{dry}, 1.45}};  // less than a tenth
  const Finding f = found();
  EXPECT_THAT(f.effects, IsEmpty());
  EXPECT_DOUBLE_EQ(f.current.held_out.error(), 1.5);
}

TEST_F(SearchOnMadeUpFits, AddsWhatRemovesMostFirst) {
  trials.errors = {{{}, 9}, {{dry}, 3}, {{air}, 6}, {{dry, air}, 1}};
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(dry, air));
  EXPECT_DOUBLE_EQ(f.current.held_out.error(), 1);
}

TEST_F(SearchOnMadeUpFits, KeepsWhatItHasFoundWhenItsWorkIsUsedUp) {
  trials.errors = {{{}, 9}, {{dry}, 3}, {{air}, 6}, {{dry, air}, 1}};
  trials.most_refits = 1;
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(dry));
  EXPECT_DOUBLE_EQ(f.current.held_out.error(), 3);
  EXPECT_EQ(trials.refitted, 1);
}

TEST_F(SearchOnMadeUpFits, PassesOverWhatTheDataDoNotDetermine) {
  trials.errors = {{{}, 9}, {{dry}, 1}, {{air}, 2}};
  trials.undetermined = {dry};
  EXPECT_THAT(found().effects, ElementsAre(air));
}

TEST_F(SearchOnMadeUpFits, TriesAllBeforeItCallsARemainderUnexplained) {
  trials.errors = {{{}, 9}, {{dry}, 3}, {{dry, air}, 1}};
  trials.unpromising = {air};
  EXPECT_THAT(found().effects, ElementsAre(dry, air));
}

TEST_F(SearchOnMadeUpFits, GoesOnWithWhatItsFirstStepsDidLittleForBeforeItCallsARemainderUnexplained) {
  trials.errors = {{{}, 9}, {{dry}, 3}, {{dry, air}, 1}};
  trials.slow = {air};
  EXPECT_THAT(found().effects, ElementsAre(dry, air));
}

TEST_F(SearchOnMadeUpFits, AsksOnceForWavesAndForTwoBesideTheSameEffects) {
  trials.errors = {{{}, 9}, {{dry}, 3}, {{dry, air}, 2}};
  EXPECT_THAT(found().effects, ElementsAre(dry, air));
  const Effects both{dry, air};
  EXPECT_EQ(trials.asked[both], 2) << "one of each, in however many passes";
}

TEST_F(SearchOnMadeUpFits, TriesAllInThePlaceOfAMemberThatLeavesARemainder) {
  trials.errors = {{{}, 9}, {{dry}, 3}, {{coil}, 1}};
  trials.unpromising = {coil};
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(coil));
  EXPECT_DOUBLE_EQ(f.current.held_out.error(), 1);
}

TEST_F(SearchOnMadeUpFits, TriesALagThatNoScorePromisesInThePlaceOfAnother) {
  trials.errors = {{{}, 9}, {{lag}, 1.04}, {{coil}, 1}};
  trials.unpromising = {coil};
  EXPECT_THAT(found().effects, ElementsAre(coil)) << "though nothing to speak of is left";
  trials.errors = {{{}, 9}, {{dry}, 1.04}, {{coil}, 1}};
  EXPECT_THAT(found().effects, ElementsAre(dry)) << "a friction stands in for no lag";
}

TEST_F(SearchOnMadeUpFits, TriesASecondBesideWhatIsNoneThatItCanBeAlone) {
  trials.errors = {{{}, 9}, {{dry}, 5}, {{dry, air}, 1}};
  trials.implausible = {{dry}};
  criterion.is_far_off = false;
  EXPECT_THAT(found().effects, UnorderedElementsAre(dry, air));
  trials.implausible = {{dry}, {dry, air}};
  EXPECT_THAT(found().effects, IsEmpty());
}

TEST_F(SearchOnMadeUpFits, TriesASecondBesideWhatDoesHardlyAnythingByItself) {
  // As dry friction does beside windage, where B has bent between the two.
  trials.errors = {{{}, 9}, {{dry}, 8.5}, {{dry, air}, 1}};
  criterion.is_far_off = false;
  EXPECT_THAT(found().effects, UnorderedElementsAre(dry, air));
  trials.errors[{dry, air}] = 2;
  EXPECT_THAT(found().effects, IsEmpty()) << "two of anything explain something";
  trials.errors[{dry, air}] = 1;
  trials.errors[{brush}] = 5;  // would be tried first, but for what it cannot be
  trials.implausible = {{brush}};
  EXPECT_THAT(found().effects, UnorderedElementsAre(dry, air));
}

TEST_F(SearchOnMadeUpFits, AddsAgainWhereADroppedMemberLeftRoom) {
  // `brush` does nothing before `air` has gone, and `air` goes when `dry` and `coil` are there.
  trials.unpromising = {brush};
  trials.errors = {
      {{}, 9}, {{air}, 4}, {{air, dry}, 3}, {{air, dry, coil}, 2}, {{dry, coil}, 2}, {{dry, coil, brush}, 1}};
  EXPECT_THAT(found().effects, ElementsAre(dry, coil, brush));
}

TEST_F(SearchOnMadeUpFits, NamesNothingForWhatTheLawOfAnotherMayBeOffBy) {
  trials.errors = {{{}, 120}, {{dry}, 1.5}, {{dry, air}, 1}};  // 0.5 of the 118.5 that `dry` took away
  EXPECT_THAT(found().effects, ElementsAre(dry));
  criterion.of_a_law = 0.002;
  EXPECT_THAT(found().effects, ElementsAre(dry, air));
}

TEST_F(SearchOnMadeUpFits, NamesTheRivalThatDoesAsWell) {
  trials.errors = {{{}, 9}, {{dry}, 1}, {{air}, 1.001}};
  const Finding f = found();
  ASSERT_THAT(f.effects, ElementsAre(dry));
  ASSERT_EQ(f.rivals.count(dry), 1U);
  ASSERT_EQ(f.rivals.at(dry).size(), 1U);
  EXPECT_EQ(f.rivals.at(dry)[0].effect, air);
}

TEST_F(SearchOnMadeUpFits, KeepsWhatComesNearWhereBothSayHowLateEdgesCome) {
  trials.errors = {{{}, 9}, {{lag}, 1}, {{coil}, 1.08}, {{dry}, 1.08}};
  const Finding f = found();
  ASSERT_THAT(f.effects, ElementsAre(lag));
  EXPECT_EQ(f.rivals.count(lag), 0U);
  ASSERT_EQ(f.near.count(lag), 1U);
  ASSERT_EQ(f.near.at(lag).size(), 1U);
  EXPECT_EQ(f.near.at(lag)[0].effect, coil);
}

TEST_F(SearchOnMadeUpFits, TiesWhatDidAsWellWhenAMemberWasAddedAndDoesSoStill) {
  // Beside `dry` alone no score proposes `coil`: that has taken what there was to see of it.
  trials.errors = {{{}, 9}, {{air}, 3}, {{coil}, 3.01}, {{dry}, 8.9}, {{air, dry}, 1}, {{coil, dry}, 1}};
  trials.passed_by = {{{dry}, {coil}}};
  const Finding f = found();
  ASSERT_THAT(f.effects, UnorderedElementsAre(air, dry));
  ASSERT_EQ(f.rivals.count(air), 1U);
  EXPECT_EQ(f.rivals.at(air)[0].effect, coil);
}

TEST_F(SearchOnMadeUpFits, TiesNothingThatDidAsWellWhenAMemberWasAddedAndDoesSoNoMore) {
  trials.errors = {{{}, 9}, {{air}, 3}, {{coil}, 3.01}, {{dry}, 8.9}, {{air, dry}, 1}, {{coil, dry}, 2}};
  trials.passed_by = {{{dry}, {coil}}};
  const Finding f = found();
  ASSERT_THAT(f.effects, UnorderedElementsAre(air, dry));
  EXPECT_EQ(f.rivals.count(air), 0U);
}

TEST_F(SearchOnMadeUpFits, DropsWhatTheOthersMadeSuperfluous) {
  trials.errors = {{{}, 9}, {{air}, 4}, {{air, dry}, 2}, {{air, dry, brush}, 1}, {{dry, brush}, 1}};
  EXPECT_THAT(found().effects, ElementsAre(dry, brush));
}

TEST_F(SearchOnMadeUpFits, TriesOthersInThePlaceOfEachOnceAMemberHasGone) {
  // Beside `air` nothing does what `dry` does; when that has gone, `coil` does better.
  trials.errors = {{{}, 9},      {{air}, 4},           {{air, dry}, 2},      {{air, dry, brush}, 1.08},
                   {{brush}, 8}, {{dry, brush}, 1.08}, {{coil, brush}, 0.95}};
  EXPECT_THAT(found().effects, UnorderedElementsAre(coil, brush));
}

TEST_F(SearchOnMadeUpFits, ForgetsARivalThatWasFoundBesideAMemberThatHasGone) {
  // `coil` does as well as `dry` beside `air` and `brush`; but `air` is dropped, and beside `brush` alone it does
  // nothing.
  trials.errors = {{{}, 9},           {{air}, 4},        {{air, dry}, 2},        {{air, dry, brush}, 1},
                   {{dry, brush}, 1}, {{air, brush}, 3}, {{air, brush, coil}, 1}};
  const Finding f = found();
  ASSERT_THAT(f.effects, ElementsAre(dry, brush));
  EXPECT_EQ(f.rivals.count(dry), 0U);
}

TEST_F(SearchOnMadeUpFits, GoesOnFromWhatItHasAndNotFromAWorseFitOfTheSameEffects) {
  // `air` becomes superfluous. The first fit without it has lost its way, and two effects would halve what that leaves.
  trials.errors = {{{}, 9}, {{air}, 4}, {{air, dry}, 2}, {{air, dry, brush}, 1.2}, {{dry, brush}, 1.2}};
  trials.lost = {{{dry, brush}, 8}};
  trials.pairs = {{{dry, brush}, {coil, effect_index("eddy_brake")}}};
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(dry, brush));
  EXPECT_NEAR(f.current.held_out.error(), 1.2, 1e-9);
}

TEST_F(SearchOnMadeUpFits, NeedsNothingOnlySinceAFitWithoutItLosesItsWay) {
  trials.errors = {{{}, 9}, {{air}, 4}, {{air, dry}, 1}, {{dry}, 1}};
  trials.hidden = {{dry}};
  trials.unpromising = {dry};  // as the model is given
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(dry));
  EXPECT_NEAR(f.current.held_out.error(), 1, 1e-9);
}

TEST_F(SearchOnMadeUpFits, HoldsAnAnswerAgainstOthersWhereTheDataHaveChanged) {
  trials.errors = {{{}, 9}, {{air}, 2}, {{dry}, 4}};
  Finding before = found();
  ASSERT_THAT(before.effects, ElementsAre(air));
  trials.errors = {{{}, 9}, {{air}, 4}, {{dry}, 1}};
  const Finding f = Search(trials, criterion, before, trials.trial({}).held_out).held_against_others();
  EXPECT_THAT(f.effects, ElementsAre(dry));
  const auto held_out = [&](std::size_t effect) {
    return std::ranges::find(f.candidates, effect, [](const Candidate& c) { return c.score.effect; })->held_out_error;
  };
  EXPECT_NEAR(held_out(air).value(), 4, 1e-9) << "as the data are now";
}

TEST_F(SearchOnMadeUpFits, CollectsTheRivalsAgainOfWhatStayedWhenAMemberHasGone) {
  trials.errors = {{{}, 9}, {{dry}, 1}};
  Finding stayed = found();
  ASSERT_THAT(stayed.rivals[dry], testing::IsEmpty());
  trials.errors = {{{}, 9}, {{dry}, 1}, {{air}, 1.001}};
  const Finding f = Search(trials, criterion, stayed, trials.trial({}).held_out).with_rivals_renewed();
  EXPECT_THAT(f.effects, ElementsAre(dry));
  ASSERT_EQ(f.rivals.at(dry).size(), 1U);
  EXPECT_EQ(f.rivals.at(dry)[0].effect, air);
}

TEST_F(SearchOnMadeUpFits, TriesWhatNeedsAnEffectBesideThatWhereAnotherStandsForIt) {
  const std::size_t zone = effect_index("driver_dead_zone"), falling = effect_index("stribeck_friction");
  trials.errors = {{{}, 9}, {{zone}, 3}, {{dry}, 3.01}, {{dry, falling}, 1}};
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(dry, falling));
  EXPECT_NEAR(f.current.held_out.error(), 1, 1e-9);
}

TEST_F(SearchOnMadeUpFits, TiesWhatDoesAsWellWithoutAParameterThatItDoesNotNeed) {
  const std::size_t load = effect_index("load_torque"), uneven = effect_index("asymmetric_friction");
  trials.counts_parameters = true;
  trials.errors = {{{}, 9}, {{dry}, 4}, {{dry, load}, 1}, {{dry, uneven}, 1}};
  const Finding f = found();
  ASSERT_THAT(f.effects, ElementsAre(dry, load)) << "which has one parameter less";
  ASSERT_EQ(f.rivals.at(load).size(), 1U);
  EXPECT_EQ(f.rivals.at(load)[0].effect, uneven);
  const std::vector<Parameter>& of_it = f.rivals.at(load)[0].model.parameters_of(uneven);
  EXPECT_EQ(std::ranges::count(of_it, true, &Parameter::fixed), 1) << "and is told with one of its two";
}

TEST_F(SearchOnMadeUpFits, AsksMoreOfACoilThatMendsTheLawOfADriver) {
  criterion.edges_tell_two = false;
  trials.errors = {{{}, 9}, {{lag}, 2}, {{lag, coil}, 1}, {{lag, dry}, 1.2}};
  EXPECT_THAT(found().effects, ElementsAre(lag, dry)) << "nobody reads the terminals";
}

TEST_F(SearchOnMadeUpFits, GoesOnFromAnAnswerWithoutWhatItsModelWithholds) {
  trials.errors = {{{}, 9}, {{air}, 4}};
  const Finding before = found();
  ASSERT_THAT(before.effects, ElementsAre(air));
  trials.errors = {{{}, 9}, {{air}, 4}, {{air, dry}, 1}, {{air, brush}, 2}, {{coil}, 1}};
  const auto gone_on = [&](std::vector<std::size_t> without) {
    Finding from = before;
    from.current.fit.model.withheld = std::move(without);
    return Search(trials, criterion, from, trials.trial({}).held_out).gone_on(6).effects;
  };
  EXPECT_THAT(gone_on({}), ElementsAre(air, dry));
  EXPECT_THAT(gone_on({dry, coil}), ElementsAre(air, brush));
  EXPECT_THAT(gone_on({dry, brush}), ElementsAre(coil)) << "in the place of what was found";
}

TEST_F(SearchOnMadeUpFits, SwapsNothingForWhatMendsTheLawOfAnotherMember) {
  const std::size_t delay = effect_index("driver_delay");
  criterion.edges_tell_two = false;
  trials.errors = {{{}, 9}, {{lag}, 4}, {{delay}, 8}, {{lag, air}, 2}, {{lag, delay}, 1.8}};
  const Finding f = found();
  EXPECT_THAT(f.effects, ElementsAre(lag, air));
  for (const Step& step : f.steps) EXPECT_THAT(step.action, Not(HasSubstr("swapped")));
}

TEST_F(SearchOnMadeUpFits, ProgressOnlyGrows) {
  Effects held;
  double error = 64;
  trials.errors[held] = error;
  for (const std::size_t effect : {dry, air, brush, coil}) {
    held.insert(effect);
    trials.errors[held] = error /= 2;
  }
  ASSERT_EQ(found().effects.size(), 4U);
  ASSERT_GE(shares.size(), 5U);
  EXPECT_TRUE(std::ranges::is_sorted(shares));
}

TEST(Finding, EndsItsStepsWithTheErrorThatItEndsWith) {
  Finding found{MadeUp::trial(Model{}, 2), {}, {}, {}, {}, {}, {}, {{"fitted", {}, 5, 5}}};
  const std::vector<Step> steps = found.steps_to_the_end();
  ASSERT_EQ(steps.size(), 2U);
  EXPECT_EQ(steps.back().train, 2);
  EXPECT_EQ(steps.back().held_out, 2);
  EXPECT_FALSE(steps.back().added.has_value());
  found.steps = steps;
  EXPECT_EQ(found.steps_to_the_end().size(), 2U) << "it is told once";
}

}  // namespace
}  // namespace emtb
