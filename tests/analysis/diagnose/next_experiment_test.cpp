#include "analysis/diagnose/next_experiment.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "model/catalogue.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using testing::Each;
using testing::Field;
using testing::IsEmpty;
using testing::Lt;

Model with(Model model, const char* effect, std::initializer_list<double> values) {
  const std::size_t index = effect_index(effect);
  model.include(index);
  auto& parameters = std::ranges::find(model.effects, index, &IncludedEffect::effect)->parameters;
  auto parameter = parameters.begin();
  for (const double value : values) (parameter++)->value = value;
  return model;
}

/// The fast bench's runs as somebody records them who has a tachogenerator alone.
std::vector<emtb::Run> runs_of_speed_alone(const blind::Bench& bench) {
  std::vector<emtb::Run> runs = record(bench, bench.train, 1);
  for (emtb::Run& run : runs) {
    std::erase_if(run.signals, [](const auto& s) { return s.first != Signal::u_ref && s.first != Signal::omega; });
  }
  return runs;
}

TEST(NextExperiment, AsksForTheCurrentWhereSpeedAloneCannotTellFrictionFromADropOfVoltage) {
  const blind::Bench bench = blind::fast_bench();
  const std::vector<emtb::Run> runs = runs_of_speed_alone(bench);
  const Dataset data = prepare(runs, {}, bench.model);
  const double R_a = bench.model.base[base::R_a].value, K_m = bench.model.base[base::K_m].value, T_c = 0.01;  // [N m]
  const Model friction = with(bench.model, "coulomb_friction", {T_c});
  const Model drop = with(bench.model, "brush_drop", {T_c / K_m * R_a});
  const std::vector<Proposal> all = next_experiments(runs, data, friction, std::vector{drop});
  ASSERT_FALSE(all.empty());
  EXPECT_THAT(all.front().record, testing::ElementsAre(Signal::i_a));
  EXPECT_GT(all.front().separation, worth_an_experiment);
  const auto same_without = std::ranges::find_if(
      all, [&](const Proposal& p) { return p.record.empty() && p.profile.name() == all.front().profile.name(); });
  ASSERT_NE(same_without, all.end());
  EXPECT_LT(same_without->separation, 0.5 * all.front().separation);
}

TEST(NextExperiment, FindsNoneThatTellsAModelFromItself) {
  const blind::Bench bench = blind::fast_bench();
  const std::vector<emtb::Run> runs = record(bench, bench.train, 1);
  const Model friction = with(bench.model, "coulomb_friction", {0.01});
  const std::vector<Proposal> all =
      next_experiments(runs, prepare(runs, {}, bench.model), friction, std::vector{friction});
  ASSERT_FALSE(all.empty());
  EXPECT_THAT(all, Each(Field(&Proposal::separation, Lt(worth_an_experiment))));
}

TEST(NextExperiment, StaysWithinTheReferencesThatTheDataHaveShown) {
  const blind::Bench bench = blind::fast_bench();
  const std::vector<emtb::Run> runs = record(bench, bench.train, 1);
  double low = 0, high = 0;
  for (const emtb::Run& run : runs) {
    const auto [least, most] = std::ranges::minmax(run.at(Signal::u_ref).value);
    low = std::min(low, least);
    high = std::max(high, most);
  }
  const Model friction = with(bench.model, "coulomb_friction", {0.01});
  const std::vector<Proposal> all =
      next_experiments(runs, prepare(runs, {}, bench.model), friction, std::vector{bench.model});
  ASSERT_FALSE(all.empty());
  for (const Proposal& p : all) {
    EXPECT_GE(p.profile.min(), low) << p.profile.name();
    EXPECT_LE(p.profile.max(), high) << p.profile.name();
  }
}

TEST(NextExperiment, FillsTheFirstWindowOfAVoltageThatIsAMean) {
  const blind::Bench bench = blind::fast_bench();
  std::vector<emtb::Run> runs = record(bench, bench.train, 1);
  ASSERT_TRUE(runs.front().has(Signal::e_a));
  const Dataset data = prepare(runs, {}, bench.model);
  for (emtb::Run& run : runs) run.signals.at(Signal::e_a).window = 0.05;
  const Model friction = with(bench.model, "coulomb_friction", {0.01});
  const std::vector<Proposal> all = next_experiments(runs, data, friction, std::vector{bench.model});
  ASSERT_FALSE(all.empty());
  EXPECT_GT(all.front().separation, worth_an_experiment);
}

TEST(BroaderExperiments, AreLongerOnesOfAllKindsThatTheBenchAllows) {
  const Model model = blind::fast_bench().model;
  const auto names = [](const std::vector<Profile>& all) {
    std::vector<std::string> list;
    for (const Profile& p : all) list.push_back(p.name());
    return list;
  };
  const std::vector<Profile> all = broader_experiments(model, {.low = -3, .high = 3});
  EXPECT_THAT(names(all),
              testing::ElementsAre("slow_ramp", "coast_down", "small_steps", "random_steps", "reversal", "staircase"));
  EXPECT_THAT(names(broader_experiments(model, {.low = 0, .high = 3, .longest = 50})),
              testing::ElementsAre("coast_down", "small_steps", "random_steps", "staircase"))
      << "no reversal in one direction, no ramp of a minute";
  const std::vector<Profile> slower =
      broader_experiments(model, {.low = -3, .high = 3, .limits = {{Signal::omega, 100.0}}});
  ASSERT_FALSE(slower.empty());
  for (const Profile& p : slower) {
    EXPECT_LT(p.max(), 3) << p.name();
  }
}

TEST(NextExperiment, IsSaidInASentence) {
  Proposal p{step("coast_down", 5, 1, 2, 3), "a step and a rest", {Signal::i_a}, 4.2};
  EXPECT_EQ(
      in_words(p),
      "Run `coast_down`: a step and a rest, with a fast i_a_A recorded beside. It would bring their predictions 4.2 "
      "noise floors apart.");
  p.separation = 0.1;
  EXPECT_EQ(in_words(p), "Nothing on this bench can tell them apart.");
}

TEST(NextExperiment, HasNothingToProposeWithoutARival) {
  const blind::Bench bench = blind::fast_bench();
  const std::vector<emtb::Run> runs = record(bench, bench.train, 1);
  EXPECT_THAT(next_experiments(runs, prepare(runs, {}, bench.model), bench.model, {}), IsEmpty());
}

}  // namespace
}  // namespace emtb
