#include "report/answer.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

#include "experiment/profile.h"
#include "model/catalogue.h"
#include "report/verdict.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

const NamedFiles files{.model = "my motor.yaml", .sessions = {"a.csv"}, .held_out = {"b.csv@1:2"}, .map = "names.yaml"};

Diagnosis answer(Verdict verdict, std::vector<MissingEffect> missing = {}) {
  Diagnosis d;
  d.verdict = verdict;
  d.missing = std::move(missing);
  d.base_train = 9;
  d.base_held_out = 10;
  d.final_train = 1;
  d.final_held_out = 2.5;
  return d;
}

MissingEffect friction() {
  Parameter T_c;
  T_c.symbol = "T_c";
  T_c.unit = "N m";
  T_c.value = 0.05;
  T_c.std_error = 0.001;
  return {.effect = effect_index("coulomb_friction"), .tied_with = {}, .parameters = {T_c}};
}

TEST(Answer, IsFiveLinesWhateverTheVerdict) {
  for (const Verdict v :
       {Verdict::found, Verdict::tied, Verdict::unknown_effect, Verdict::nothing_missing, Verdict::cannot_tell}) {
    MissingEffect one = friction();
    one.tied_with = {effect_index("windage")};
    const bool named = v == Verdict::found || v == Verdict::tied;
    const std::string text = answer_text(answer(v, named ? std::vector{one} : std::vector<MissingEffect>{}), files);
    EXPECT_EQ(std::ranges::count(text, '\n'), 5) << text;
    EXPECT_THAT(text, AllOf(StartsWith("missing  "), HasSubstr("\nsize     "),
                            HasSubstr("\nsure     " + std::string(word(v)) + ": "),
                            HasSubstr("\nerror    10 -> 2.5 noise floors held out, 9 -> 1 in training\n"),
                            HasSubstr("\nnext     emtb ")));
  }
}

TEST(Answer, SaysWithWhichHeldValuesASizeGoes) {
  Diagnosis d = answer(Verdict::found, {friction()});
  d.pins = {{.place = 0, .parameter = "R_a", .value = 2.9, .unit = "ohm", .followers = {{"coulomb_friction.T_c", -1}}}};
  EXPECT_THAT(answer_text(d, files), HasSubstr("size     T_c = 0.05 +- 0.001 N m if R_a is 2.9 ohm\n"));
}

TEST(Answer, TellsNoPhaseThatIsHeldSinceEachRunStartsAtAnAngleOfItsOwn) {
  Model model;
  const std::size_t weight = effect_index("eccentric_load");
  model.include(weight);
  std::vector<Parameter>& values = model.parameters_of(weight);
  values[0].value = 0.02;
  values[0].std_error = 1e-3;
  ASSERT_TRUE(values[1].fixed);
  Diagnosis d = answer(Verdict::found, {{.effect = weight, .tied_with = {}, .parameters = values}});
  EXPECT_THAT(answer_text(d, files), HasSubstr("size     T_e = 0.02 +- 0.001 N m\n"));
  EXPECT_THAT(verdict_text(d), Not(HasSubstr("phase =")));
  values[1].fixed = false;
  d.missing[0].parameters = values;
  EXPECT_THAT(answer_text(d, files), HasSubstr(", phase = 0 rad"));
}

TEST(Answer, NamesWhatIsTiedAndWhatHasNoName) {
  MissingEffect one = friction();
  one.tied_with = {effect_index("windage")};
  EXPECT_THAT(answer_text(answer(Verdict::tied, {one}), files),
              HasSubstr("missing  one of coulomb_friction or windage\n"));
  EXPECT_THAT(
      answer_text(answer(Verdict::unknown_effect, {friction()}), files),
      AllOf(HasSubstr(
                "missing  coulomb_friction (Coulomb friction) and something that no effect of the library explains\n"),
            HasSubstr("2.5 noise floors remain without a name")));
  EXPECT_THAT(answer_text(answer(Verdict::nothing_missing), files),
              HasSubstr("missing  nothing that these runs show\n"));
}

TEST(Answer, OfForeignFilesThatAreTiedLeadsToThePageThatShowsWhatToRecord) {
  MissingEffect one = friction();
  one.tied_with = {effect_index("windage")};
  Diagnosis tied = answer(Verdict::tied, {one});
  tied.next.push_back({emtb::step("coast_down", 5, 1, 2, 3), "a step and a rest", {Signal::i_a}, 4.2});
  EXPECT_THAT(answer_text(tied, files), HasSubstr("\nnext     emtb report "));
  NamedFiles own = files;
  own.map.clear();
  EXPECT_THAT(answer_text(tied, own), HasSubstr("\nnext     emtb investigate "));
}

TEST(Answer, WhatIsTiedNeedNotBeTheFirst) {
  MissingEffect second = friction();
  second.tied_with = {effect_index("windage")};
  EXPECT_THAT(answer_text(answer(Verdict::tied, {friction(), second}), files),
              HasSubstr("\nnext     emtb effects windage\n"));
  second.tied_with = {effect_count};  // a formula of the user's
  Diagnosis with_a_formula = answer(Verdict::tied, {second});
  with_a_formula.final.offered.emplace_back().info = std::make_shared<EffectInfo>();
  EXPECT_THAT(answer_text(with_a_formula, files), HasSubstr("\nnext     emtb effects coulomb_friction\n"));
}

TEST(Answer, ALoneRunSaysThatItJudgedItself) {
  Diagnosis d = answer(Verdict::found, {friction()});
  d.judged_on_training = true;
  EXPECT_THAT(answer_text(d, files), AllOf(HasSubstr("judged on itself"), HasSubstr("the run itself")));
}

TEST(Answer, SaysThatWhatIsLeftIsNoNoiseThoughNothingIsMissing) {
  Diagnosis d = answer(Verdict::nothing_missing);
  EXPECT_THAT(answer_text(d, files), HasSubstr("what is left is noise, or too little to matter"));
  d.signals[Signal::omega].ratio = 23;  // floors
  EXPECT_THAT(answer_text(d, files),
              HasSubstr("what is left is too little to matter, or of no law that these runs show again"));
}

TEST(Answer, WhatOnlyTrainingRunsShowIsToldByTheirError) {
  Diagnosis d = answer(Verdict::found, {friction()});
  d.training_judges = true;
  d.base_held_out = d.final_held_out = 1.01;
  d.base_train = 10;
  d.final_train = 0.9;
  EXPECT_THAT(answer_text(d, files), HasSubstr("shown by training runs alone: each was held out in turn"));
  EXPECT_THAT(verdict_in_words(d),
              HasSubstr("the error on the training runs, which alone show it, falls from 10 noise floors to 0.9;"));
}

TEST(Answer, WhatOnlyAHeldOutRunShowsIsToBeTrainedOn) {
  Diagnosis d = answer(Verdict::unknown_effect);
  d.shown_by = {"b.csv@1:2"};
  EXPECT_THAT(
      answer_text(d, files),
      AllOf(HasSubstr("remain without a name, and only b.csv@1:2 shows it: training runs do not, or by far less\n"),
            HasSubstr("\nnext     emtb diagnose 'my motor.yaml' a.csv b.csv@1:2 --map names.yaml\n")));
  d.shown_by = {"b.csv#one", "b.csv#two"};
  EXPECT_THAT(answer_text(d, files),
              HasSubstr("and only b.csv#one and b.csv#two show it: training runs do not, or by far less\n"));
  d.shown_by = {"a.csv#high"};
  EXPECT_EQ(next_command(d, {.model = "m.yaml", .sessions = {"a.csv#one"}, .held_out = {"a.csv#low", "a.csv#high"}}),
            "emtb diagnose m.yaml 'a.csv#one' 'a.csv#high' --held-out 'a.csv#low'");
  EXPECT_THAT(next_command(d, {.model = "m.yaml", .sessions = {"b.csv"}, .held_out = {"c.csv"}}),
              StartsWith("emtb report "))
      << "a run that is in none of the files";
}

TEST(Answer, ARunThatWasFittedTooIsSaidToBeAndTheNextCommandFitsItToo) {
  Diagnosis d = answer(Verdict::found, {friction()});
  d.fitted_too = {"b.csv@1:2"};
  EXPECT_THAT(
      answer_text(d, files),
      AllOf(HasSubstr("(b.csv@1:2, which the training runs do not foretell, was fitted, too, and judges no longer)"),
            HasSubstr("emtb add coulomb_friction 'my motor.yaml' a.csv b.csv@1:2 --map names.yaml")));
}

TEST(NextCommand, IsToBeTypedAsItStands) {
  EXPECT_EQ(next_command(answer(Verdict::found, {friction()}), files),
            "emtb add coulomb_friction 'my motor.yaml' a.csv --held-out b.csv@1:2 --map names.yaml --out "
            "'my motor-with-coulomb_friction.yaml'");
  EXPECT_THAT(next_command(answer(Verdict::unknown_effect), files), StartsWith("emtb report 'my motor.yaml' a.csv"));
  EXPECT_THAT(next_command(answer(Verdict::nothing_missing), files), StartsWith("emtb calibrate "));
  NamedFiles written = files;
  written.out = "found.yaml";
  EXPECT_EQ(next_command(answer(Verdict::found, {friction()}), written),
            "emtb compare found.yaml b.csv@1:2 --map names.yaml");
  written.candidates = "mine.yaml";
  EXPECT_THAT(next_command(answer(Verdict::nothing_missing),
                           {.model = "m.yaml", .sessions = {"a.csv"}, .candidates = "mine.yaml"}),
              Not(HasSubstr("--candidates")))
      << "calibrate takes none";
}

}  // namespace
}  // namespace emtb
