#include "config/formula_effect.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "config/model.h"
#include "model/catalogue.h"
#include "model/effect.h"
#include "tests/config/complains.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr const char* with_formulas =
    "name: own\n"
    "tie: {K_m: K_b}\n"
    "parameters: {R_a: {value: 1, fixed: true}, K_b: {value: 1, fixed: true}, B: {value: 1, fixed: true}, J: {value: "
    "1, "
    "fixed: true}}\n"
    "effects:\n"
    "  windage: {}\n"
    "  my_cubic:\n"
    "    torque: \"-c3*omega^3\"\n"
    "    parameters:\n"
    "      c3: {value: 2.0e-7, min: 0, max: 1.0e-6, null: 0, unit: N m s3/rad3}\n"
    "  weak_field:\n"
    "    flux: 1 - k*tanh(abs(i_a)/i_k)\n"
    "    parameters: {i_k: {value: 2, min: 0.5, max: 8, unit: A}, k: {value: 0.1, min: 0, max: 0.5}}\n";

Model model_with(const std::string& text) { return read_model(YamlMap::parse(text, "own.yaml")); }

std::string complaint_with(const std::string& from, const std::string& to) {
  std::string text = with_formulas;
  const auto at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
  return complaint([&] { model_with(text); });
}

void expect_both_formulas(const Model& m) {
  EXPECT_EQ(m.effects.size(), 1U);
  ASSERT_EQ(m.terms.size(), 2U);
  EXPECT_EQ(m.terms[0].name, "my_cubic");
  EXPECT_EQ(m.terms[0].place, TermPlace::torque);
  EXPECT_EQ(m.terms[0].formula, "-c3*omega^3");
  EXPECT_EQ(m.terms[1].place, TermPlace::flux);
  EXPECT_THAT(m.names(), testing::IsSupersetOf({"windage.c_w", "my_cubic.c3", "weak_field.k", "weak_field.i_k"}));
  const Parameter& c3 = m.terms[0].parameters.at(0);
  EXPECT_DOUBLE_EQ(c3.value, 2e-7);
  EXPECT_DOUBLE_EQ(c3.max, 1e-6);
  EXPECT_EQ(c3.unit, "N m s3/rad3");
  TermInput by;
  std::vector<double> by_parameter(1);
  EXPECT_DOUBLE_EQ(m.terms[0].term->evaluate({10, 0, 0, 0, 0}, std::vector{2e-7}, by, by_parameter), -2e-4);
}

TEST(FormulaEffect, IsReadFromAModelFile) { expect_both_formulas(model_with(with_formulas)); }

TEST(FormulaEffect, IsWrittenBackAsItWasRead) {
  Model m = model_with(with_formulas);
  m.terms[0].parameters[0].std_error = 3e-9;
  const Model again = model_with(to_yaml(m));
  expect_both_formulas(again);
  EXPECT_EQ(again.terms[0].parameters[0].std_error, 3e-9);
  EXPECT_EQ(to_yaml(again), to_yaml(m));
}

TEST(FormulaEffect, StatesWhatASearchMustKnow) {
  const Model m = model_with(with_formulas);
  const EffectInfo& cubic = *m.terms[0].info;
  EXPECT_EQ(cubic.id, "my_cubic");
  EXPECT_EQ(cubic.equation, "T = -c3*omega^3");
  EXPECT_EQ(cubic.stage, Stage::shaft);
  EXPECT_TRUE(cubic.opposes_motion) << "its bounds keep it from being negative";
  EXPECT_FALSE(cubic.fades());
  const EffectInfo& field = *m.terms[1].info;
  EXPECT_EQ(field.parameter_list[0].symbol, "k") << "the amplitude first";
  EXPECT_FALSE(field.parameter_list[0].is_shape());
  EXPECT_TRUE(field.parameter_list[1].is_shape()) << "a current that cannot be 0";
}

constexpr const char* with_memory =
    "  creeping:\n"
    "    torque: \"-a*z\"\n"
    "    memory: {z: (omega/r - z)/tau}\n"
    "    parameters: {tau: {value: 0.2, min: 0.05, max: 2, unit: s}, r: {value: 100, fixed: true}, a: {value: 0, min: "
    "-1, "
    "max: 1, unit: N m}}\n";

TEST(FormulaEffect, MayRemember) {
  const Model m = model_with(std::string(with_formulas) + with_memory);
  const AddedTerm& creeping = m.terms.back();
  EXPECT_EQ(creeping.memory, "z");
  EXPECT_EQ(creeping.rate_formula, "(omega/r - z)/tau");
  EXPECT_EQ(creeping.info->equation, "T = -a*z, dz/dt = (omega/r - z)/tau");
  EXPECT_TRUE(m.structure().terms.back().rate);
  EXPECT_FALSE(m.structure().terms.front().rate) << "the others do not";
  TermInput by;
  std::vector<double> by_parameter(3);
  // The amplitude stands first: a, tau, r.
  EXPECT_DOUBLE_EQ(creeping.rate->evaluate({50, 0, 0, 0, 0, 0.1}, std::vector{1.0, 0.2, 100.0}, by, by_parameter), 2);
  EXPECT_DOUBLE_EQ(by.memory, -5);
  EXPECT_DOUBLE_EQ(by_parameter[1], -10);
  EXPECT_DOUBLE_EQ(creeping.term->evaluate({50, 0, 0, 0, 0, 0.1}, std::vector{1.0, 0.2, 100.0}, by, by_parameter),
                   -0.1);
  EXPECT_EQ(to_yaml(model_with(to_yaml(m))), to_yaml(m));
}

TEST(FormulaEffect, ComplaintsOfWhatItRemembersNameFileLineAndKey) {
  const auto complaint_with = [](const std::string& from, const std::string& to) {
    std::string text = std::string(with_formulas) + with_memory;
    text.replace(text.find(from), from.size(), to);
    return complaint([&] { model_with(text); });
  };
  EXPECT_THAT(complaint_with("-a*z", "-a*omega"), HasSubstr("creeping.torque does not use z, which stands under"));
  EXPECT_THAT(complaint_with("omega/r", "speed/r"),
              HasSubstr("own.yaml:15: effects.creeping.memory.z uses `speed` at column 2"));
  EXPECT_THAT(complaint_with("omega/r - z", "omega - z"), HasSubstr("does not use its parameter r"));
  EXPECT_THAT(complaint_with("omega/r - z", "1/omega - z/r"), HasSubstr("creeping.memory.z is inf at rest"));
  EXPECT_THAT(complaint_with("{z: (", "{y: -y, z: ("), HasSubstr("creeping.memory names 2 quantities"));
  EXPECT_THAT(complaint_with("{z: (", "{omega: ("), HasSubstr("memory.omega means something else in formulas"));
  EXPECT_THAT(complaint_with("{z: (", "{tau: ("), HasSubstr("memory.tau is a parameter, too"));
}

TEST(FormulaEffect, ANullThatIsNotZeroIsKept) {
  const std::string text =
      std::string(with_formulas) + "  gain: {flux: g, parameters: {g: {value: 1.1, min: 0.5, max: 2, null: 1}}}\n";
  const Model m = model_with(to_yaml(model_with(text)));
  EXPECT_EQ(m.terms.back().info->parameter_list[0].null, 1);
}

TEST(FormulaEffect, ComplaintsNameFileLineAndKey) {
  EXPECT_THAT(complaint_with("-c3*omega^3", "-c4*omega^3"),
              HasSubstr("own.yaml:7: effects.my_cubic.torque uses `c4` at column 2"));
  EXPECT_THAT(complaint_with("-c3*omega^3", "-c3*omega^"),
              HasSubstr("own.yaml:7: effects.my_cubic.torque ends too early"));
  EXPECT_THAT(complaint_with("-c3*omega^3", "-omega^3"),
              HasSubstr("effects.my_cubic.torque does not use its parameter c3"));
  EXPECT_THAT(complaint_with("-c3*omega^3", "-c3/omega"),
              AllOf(HasSubstr("effects.my_cubic.torque"), HasSubstr("at rest")));
  EXPECT_THAT(complaint_with("-c3*omega^3", "1 - c3*omega^3"),
              AllOf(HasSubstr("effects.my_cubic.torque is 1"), HasSubstr("must be 0")));
  EXPECT_THAT(complaint_with("-c3*omega^3", "-c3*omega^1.5"), HasSubstr("is not finite at omega -10"));
  EXPECT_THAT(complaint_with("1 - k*tanh", "2 - k*tanh"), HasSubstr("must be 1"));
  EXPECT_THAT(complaint_with("  my_cubic:", "  eddy_brake:"),
              HasSubstr("own.yaml:6: effects.eddy_brake is an effect of the library"));
  EXPECT_THAT(complaint_with("  my_cubic:", "  J:"), HasSubstr("effects.J is a parameter of the base model"));
  EXPECT_THAT(complaint_with("  my_cubic:", "  my-cubic:"), HasSubstr("effects.my-cubic is no name"));
  EXPECT_THAT(complaint_with("      c3: {", "      B: {"),
              HasSubstr("effects.my_cubic.parameters.B is a parameter of the base model"));
  EXPECT_THAT(complaint_with("      c3: {", "      sin: {"), HasSubstr("parameters.sin means something else"));
  EXPECT_THAT(complaint_with("    torque:", "    force:"), HasSubstr("effects.my_cubic"));
  EXPECT_THAT(complaint_with("    torque:", "    voltage: c3*i_a\n    torque:"), HasSubstr("stands beside"));
  EXPECT_THAT(complaint_with("min: 0, max: 1.0e-6, ", ""), HasSubstr("needs min and max (or fixed: true)"));
  EXPECT_THAT(complaint_with("null: 0", "null: 1"), HasSubstr("c3.null is outside min and max"));
  EXPECT_THAT(complaint_with("null: 0", "zero: 0"), HasSubstr("c3.zero is not known here"));
  EXPECT_THAT(complaint_with("value: 2.0e-7", "value: 2"), HasSubstr("outside its bounds"));
}

// ---- files of candidates

class CandidatesFile : public testing::Test {
 protected:
  std::filesystem::path write(const std::string& text) const {
    std::ofstream(file_) << text;
    return file_;
  }
  void TearDown() override { std::filesystem::remove(file_); }

 private:
  std::filesystem::path file_ =
      std::filesystem::path(testing::TempDir()) /
      (std::string("emtb_candidates_") + testing::UnitTest::GetInstance()->current_test_info()->name() + ".yaml");
};

constexpr const char* two_candidates =
    "linear_in_time: {torque: \"-a*t\", parameters: {a: {value: 0, min: 0, max: 1, unit: N m/s}}}\n"
    "pull: {voltage: \"-b*sin(theta)\", parameters: {b: {value: 0, min: -1, max: 1, unit: V}}}\n";

TEST_F(CandidatesFile, OffersItsFormulasBehindTheLibrary) {
  Model m = model_with(with_formulas);
  offer(m, write(two_candidates));
  ASSERT_EQ(m.known_effects(), effect_count + 2);
  const std::size_t pull = m.effect_named("pull");
  EXPECT_EQ(m.about(pull).id, "pull");
  EXPECT_FALSE(m.includes(pull));
  const std::size_t before = m.values().size();
  m.include(pull);
  EXPECT_TRUE(m.includes(pull));
  EXPECT_EQ(m.values().size(), before + 1);
  EXPECT_EQ(m.parameters_of(pull).at(0).symbol, "b");
  EXPECT_EQ(m.parameters_of(pull).at(0).value, 0);
  m.exclude(pull);
  EXPECT_FALSE(m.includes(pull));
  EXPECT_EQ(m.values().size(), before);
  EXPECT_EQ(m.effect_named("windage"), effect_index("windage"));
  try {
    m.effect_named("gremlins");
    FAIL() << "nobody knows gremlins";
  } catch (const ModelError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr("gremlins"), HasSubstr("windage"), HasSubstr("pull")));
  }
}

TEST_F(CandidatesFile, MayPutThemUnderEffectsAsAModelDoes) {
  std::string nested = "effects:\n";
  for (const char c : std::string("  ") + two_candidates) nested += c == '\n' ? std::string("\n  ") : std::string(1, c);
  const auto all = read_candidates(write(nested + "\n"));
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[1].name, "pull");
}

TEST_F(CandidatesFile, MustAgreeWithTheFormulasOfTheModel) {
  Model m = model_with(with_formulas);
  const std::string same = "my_cubic: {torque: \"-c3*omega^3\", parameters: {c3: {value: 0, min: 0, max: 1}}}\n";
  offer(m, write(same));
  EXPECT_TRUE(m.includes(m.effect_named("my_cubic"))) << "the model's own";
  const std::string other = "my_cubic: {torque: \"-c3*omega\", parameters: {c3: {value: 0, min: 0, max: 1}}}\n";
  EXPECT_THAT(complaint([&] { offer(m, write(other)); }),
              HasSubstr("my_cubic stands in the model with another formula"));
}

TEST(ShippedCandidates, AllRead) {
  for (const auto& entry : std::filesystem::directory_iterator(EMTB_SOURCE_DIR "/config/candidates")) {
    EXPECT_FALSE(read_candidates(entry.path()).empty()) << entry.path();
  }
}

TEST_F(CandidatesFile, ComplaintsNameFileLineAndKey) {
  EXPECT_THAT(complaint([&] { read_candidates(write("a: {torque: omega*}\n")); }),
              HasSubstr(".yaml:1: a.torque ends too early"));
  EXPECT_THAT(complaint([&] { read_candidates(write("\nwindage: {}\n")); }),
              HasSubstr(".yaml:2: windage is an effect of the library"));
  EXPECT_THAT(complaint([&] { read_candidates(write("mine: {parameters: {}}\n")); }), HasSubstr("needs a formula"));
  EXPECT_THAT(complaint([&] { read_candidates(write("{}\n")); }), HasSubstr("holds no formula"));
  EXPECT_THAT(complaint([&] { read_candidates("absent.yaml"); }), HasSubstr("absent.yaml: cannot be read"));
}

}  // namespace
}  // namespace emtb
