#include "export/equations.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>

#include "export/export_text.h"
#include "export/linear.h"
#include "export/step_text.h"
#include "hal/error.h"
#include "tests/export/models.h"

namespace emtb {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

std::string refusal(const std::function<void()>& call) {
  try {
    call();
  } catch (const ModelError& e) {
    return e.what();
  }
  return "not refused";
}

TEST(WrittenEffects, NameParametersOfTheirEffectAndTermsOfTheStep) {
  const std::set<std::string_view> terms{"gain",
                                         "offset",
                                         "rise",
                                         "fall",
                                         "u",
                                         "e_min",
                                         "e_max",
                                         "output_resistance",
                                         "lag",
                                         "one_quadrant",
                                         "lets_go",
                                         "inductance",
                                         "contact_drop",
                                         "contact_knee",
                                         "reaction",
                                         "reaction_knee",
                                         "flux",
                                         "dry_friction",
                                         "braking_torque",
                                         "viscous",
                                         "load_torque",
                                         "brake"};
  for (const WrittenEffect& e : written_effects()) {
    const EffectInfo& info = effect_catalogue()[effect_index(e.id)];
    std::string all;
    for (const Statement& s : e.statements) {
      EXPECT_TRUE(terms.contains(s.term)) << e.id << ": " << s.term;
      all += s.value;
    }
    for (const EffectParameter& p : info.parameters()) EXPECT_THAT(all, HasSubstr("$" + std::string(p.symbol))) << e.id;
  }
}

TEST(Equations, RefuseInOneLineThatNamesAllThatCannotBeWritten) {
  const std::string why = refusal([] { equations_of(with(with(linear_model(), "backlash"), "shaft_compliance")); });
  EXPECT_THAT(why, AllOf(HasSubstr("backlash, shaft_compliance"), HasSubstr("--linear --at"), Not(HasSubstr("\n"))));
}

TEST(Equations, LeaveTheInstrumentsOut) {
  const ExportedEquations x = equations_of(with(with(linear_model(), "tacho_lag"), "windage"));
  EXPECT_THAT(x.left_out, ElementsAre("tacho_lag"));
  EXPECT_THAT(x.included, ElementsAre("windage"));
  EXPECT_THAT(c_header(x),
              AllOf(HasSubstr("without tacho_lag"), HasSubstr("windage_c_w"), Not(HasSubstr("tacho_lag_tau"))));
}

TEST(Equations, ANameOfAModelWritesNoCode) {
  Model model = linear_model();
  model.name = "m */ int evil; /*/";
  EXPECT_THAT(c_header(equations_of(model)), AllOf(HasSubstr("`m * / int evil; /* /`"), Not(HasSubstr("*/ int evil"))));
}

TEST(Equations, TextsSayWhatTheyAre) {
  const ExportedEquations x = equations_of(with(linear_model(), "stribeck_friction"));
  EXPECT_THAT(modelica_model(x),
              AllOf(HasSubstr("Not compiled here"), HasSubstr("model linear\n"), HasSubstr("end linear;"),
                    HasSubstr("exp(-(omega/p_stribeck_friction_omega_s)")));
  EXPECT_THAT(octave_function(x, "motor"), HasSubstr("function y = motor(t, u_ref, p, load)"));
}

TEST(StepText, SpellsNamesAndCalls) {
  EXPECT_EQ(spelt("$R_a*@i_a", "p->", "s->"), "p->R_a*s->i_a");
  EXPECT_EQ(renamed("abs(x) + my_abs(x)", "abs", "fabs"), "fabs(x) + my_abs(x)");
  EXPECT_EQ(exact(20), "20.0") << "C divides whole numbers otherwise";
  EXPECT_EQ(exact(1e-9), "1e-09");
}

}  // namespace
}  // namespace emtb
