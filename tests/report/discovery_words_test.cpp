#include "report/discovery_words.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "report/discovery_figures.h"
#include "report/discovery_json.h"

namespace emtb {
namespace {

using testing::HasSubstr;

Changed changed_by(ChangeOf how, double to) {
  Changed c;
  c.how = how;
  c.run = "b.csv";
  c.runs = {"b.csv", "c.csv"};
  c.parameter = "B";
  c.unit = "N m s/rad";
  c.from = 1e-3;
  c.to = to;
  c.std_error = 2e-5;
  return c;
}

/// What is left of two runs, with a law of the speed in it.
Discovery with_a_law() {
  Discovery d;
  d.worth_a_name = true;
  d.torque.rms = 0.0123;
  d.torque.of["omega"] = {.alone = 0.62, .only = 0.4, .std_error = 0.02};
  d.torque.of["theta"] = {.alone = 0.01, .only = 0, .std_error = 0.01};
  d.torque.together = 0.65;
  d.torque.ceiling = 0.65;
  MissingTorque run;
  for (int k = 0; k <= 100; ++k) {
    run.omega.push_back(2.0 * k - 100);
    run.torque.push_back(run.omega.back() > 0 ? -0.01 : 0.01);
  }
  d.left.runs = {run, run};
  Law law;
  law.text = {"bump_torque_of_omega", TermPlace::torque, "-a*tanh(omega/s)", {"omega"}, {}};
  Parameter a;
  a.symbol = "a";
  a.unit = "N m";
  a.value = 0.01;
  a.std_error = 2e-4;
  law.parameters = {a};
  law.at = {-100, 0, 100};
  law.value = {0.01, 0, -0.01};
  law.value_error = {2e-4, 0, 2e-4};
  law.most_uncertain_at = {-100, 100};
  d.law = law;
  return d;
}

TEST(DiscoveryWords, SayWhereTheRestLivesAsARangeAndNeverAsASum) {
  const std::vector<std::string> lines = shares_in_words(with_a_law());
  ASSERT_EQ(lines.size(), 1U);
  EXPECT_THAT(lines[0], HasSubstr("the missing torque, 0.0123 N m rms"));
  EXPECT_THAT(lines[0], HasSubstr("the speed alone explains 58 % to 66 %, 40 % of it nothing else"));
  EXPECT_THAT(lines[0], testing::Not(HasSubstr("angle"))) << "less than a twentieth";
  EXPECT_THAT(lines[0], HasSubstr("35 % none"));
}

TEST(DiscoveryWords, TellTheLawWithWhatItMayBeAndWhereToLookNext) {
  const Discovery d = with_a_law();
  const std::vector<std::string> lines = law_in_words(*d.law);
  EXPECT_THAT(lines, testing::Contains(HasSubstr("torque = -a*tanh(omega/s)")));
  EXPECT_THAT(lines, testing::Contains(HasSubstr("it may be a resonance")));
  EXPECT_THAT(lines, testing::Contains(HasSubstr("not confirmed")));
  EXPECT_THAT(next_for_discovery(d), HasSubstr("omega = -100 and 100 rad/s"));
  EXPECT_EQ(next_for_discovery(Discovery{}), "");
  EXPECT_THAT(may_be({"bump_torque_of_u_ref", TermPlace::torque, "-a*u_ref", {"u_ref"}, {}}), HasSubstr("driver"));
  EXPECT_EQ(unit_over("u_ref"), "V");
}

TEST(DiscoveryWords, SayThatACurveIsNoFormulaAndWhatTheNearestLeaves) {
  Discovery d = with_a_law();
  d.law->text.is_curve = true;
  EXPECT_THAT(law_in_words(*d.law), testing::Contains("no short formula follows it"));
  d.law->nearest = FormulaText{"saturating_torque_of_omega", TermPlace::torque, "-a*tanh(omega/w)", {"omega"}, {}};
  d.law->nearest_held_out = 2.5;
  const std::vector<std::string> lines = law_in_words(*d.law);
  EXPECT_THAT(lines.front(), HasSubstr("A curve: torque = "));
  EXPECT_THAT(lines, testing::Contains(HasSubstr("the nearest, -a*tanh(omega/w), leaves 2.5 held out")));
  EXPECT_EQ(to_json(d)["laws"][0]["nearest"], "-a*tanh(omega/w)");
}

TEST(DiscoveryWords, TellARunOfAnotherMachine) {
  Discovery d;
  d.changed = {changed_by(ChangeOf::one_run, 1.04e-3), changed_by(ChangeOf::from_here_on, 0.667e-3),
               changed_by(ChangeOf::drift, 1.2e-3)};
  d.changed[0].tied_with = {"armature_heating"};
  d.disturbances = {{"a.csv", 3, 4, -0.02}};
  d.with_disturbances = WithDisturbances{3.2, 4.1, {}};
  d.train = 1.1;
  d.held_out = 1.2;
  const std::vector<std::string> lines = machine_in_words(d);
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_THAT(lines[0], HasSubstr("B is 4 % higher in b.csv"));
  EXPECT_THAT(lines[0], HasSubstr("armature_heating"));
  EXPECT_THAT(lines[1], HasSubstr("B is 33 % lower from b.csv on (2 runs)"));
  EXPECT_THAT(lines[2], HasSubstr("B grows from run to run"));
  EXPECT_THAT(lines[3], HasSubstr("a.csv: a torque of -0.02 N m from 3 to 4 s"));
  EXPECT_THAT(with_and_without(d), HasSubstr("with it: training 3.2, held-out 4.1, no law; without it: training 1.1"));
}

TEST(DiscoveryJson, HoldsWhatTheContractNames) {
  Discovery d = with_a_law();
  d.changed = {changed_by(ChangeOf::from_here_on, 2e-3)};
  d.disturbances = {{"a.csv", 3, 4, -0.02}};
  d.rmse[Signal::omega] = 0.5;
  const auto json = to_json(d);
  EXPECT_EQ(json["laws"][0]["place"], "torque");
  EXPECT_EQ(json["laws"][0]["curve"]["at"].size(), 3U);
  EXPECT_EQ(json["changed"][0]["run"], "b.csv");
  EXPECT_EQ(json["changed"][0]["how"], "from_here_on");
  EXPECT_EQ(json["disturbances"][0]["to_s"], 4);
  EXPECT_EQ(json["left"]["omega"]["rmse"], 0.5);
  EXPECT_EQ(json["left"]["omega"]["of"]["omega"], 0.62);
}

TEST(DiscoveryFigures, DrawTheLawOverWhatIsMissing) {
  const auto figure = law_figure(with_a_law());
  ASSERT_TRUE(figure);
  const std::string svg = to_svg(figure->figure);
  EXPECT_THAT(svg, HasSubstr("<svg"));
  EXPECT_THAT(svg, HasSubstr("missing, mean and scatter"));
  EXPECT_THAT(figure->caption, testing::Not(HasSubstr("remembers")));
  EXPECT_FALSE(law_figure(Discovery{}));
}

TEST(DiscoveryFigures, DrawATrendWithItsBand) {
  Trend t;
  t.parameter = "R_a";
  t.unit = "ohm";
  t.points = {{"mon", 1, 0.01, 1, 0.01}, {"tue", 1.1, 0.01, 1.1, 0.01}, {"wed", 1.2, 0.01, 1.2, 0.01}};
  t.slope = 0.1;
  t.slope_error = 0.01;
  t.whole = 0.18;
  t.clear = true;
  const std::string svg = to_svg(trend_figure({t}));
  EXPECT_THAT(svg, HasSubstr("trend, 95 %"));
  EXPECT_THAT(svg, HasSubstr("wed"));
  EXPECT_THAT(in_words(t), HasSubstr("a trend, 18 % in all"));
  EXPECT_EQ(to_json(std::vector<Trend>{t})["R_a"]["clear"], true);
}

TEST(DiscoveryFigures, AReportTellsThereIsNoLawAndWhy) {
  Page page("a", "b");
  tell(page, Discovery{});
  EXPECT_THAT(page.html(), HasSubstr("There is no law: what is left is no remainder worth a name"));
  EXPECT_THAT(page.html(), HasSubstr("No run is of another machine"));
}

TEST(DiscoveryWords, SayThatAValueRestsOnItsBound) {
  Discovery d = with_a_law();
  EXPECT_THAT(law_in_words(*d.law), testing::Not(testing::Contains(HasSubstr("at its bound"))));
  d.law->at_bound = {d.law->text.id + "." + d.law->parameters.front().symbol};
  EXPECT_THAT(law_in_words(*d.law), testing::Contains(testing::EndsWith("N m, at its bound")));
}

TEST(DiscoveryWords, SayWhatALawRemembers) {
  Discovery d = with_a_law();
  d.law->text.id = "lagging_saturation_of_omega";
  d.law->text.formula = "-a*z";
  d.law->text.rate = "(tanh(omega/w) - z)/tau";
  const std::vector<std::string> lines = law_in_words(*d.law);
  EXPECT_EQ(lines.front(), "A law: torque = -a*z, dz/dt = (tanh(omega/w) - z)/tau");
  EXPECT_THAT(lines, testing::Contains(HasSubstr("friction that needs time")));
  EXPECT_THAT(law_figure(d)->caption, HasSubstr("what it comes to where a state lasts"));
  const auto json = to_json(d);
  EXPECT_EQ(json["laws"][0]["formula"], "-a*z");
  EXPECT_EQ(json["laws"][0]["memory"]["z"], "(tanh(omega/w) - z)/tau");
}

TEST(DiscoveryWords, NameTwoQuantitiesThatSaySomethingTogether) {
  Discovery d = with_a_law();
  d.torque.of["omega and i_a"] = {.alone = 0.9, .only = 0.3, .std_error = 0.02};
  EXPECT_THAT(shares_in_words(d).front(), HasSubstr("the speed with the current alone explains 86 % to 94 %"));
}

}  // namespace
}  // namespace emtb
