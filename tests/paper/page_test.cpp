#include "paper/page.h"

#include <gmock/gmock.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <regex>
#include <sstream>

#include "paper/experiments.h"

namespace emtb::paper {
namespace {

using testing::HasSubstr;

/// All findings, computed once: two seconds.
class Paper : public ::testing::Test {
 protected:
  static void SetUpTestSuite() { findings_ = new Findings(find()); }
  static void TearDownTestSuite() { delete findings_; }
  static const Findings& f() { return *findings_; }
  static const simulated::PlantParameters& plant() { return findings_->bench.plant; }

 private:
  static Findings* findings_;
};
Findings* Paper::findings_ = nullptr;

/// Within some standard errors of the truth.
void expect_covers(const Quantity& q, double truth) {
  EXPECT_NEAR(q.value, truth, 3.5 * q.std_error) << q.symbol;
  EXPECT_LT(q.std_error, 0.02 * std::abs(truth)) << q.symbol << " is worth stating";
}

TEST_F(Paper, StaticExperimentsFindTheBenchTheyAreMadeOn) {
  const auto& m = plant().motor;
  expect_covers(f().equation_6.at("R_a"), m.R_a);
  expect_covers(f().equation_6.at("K_b"), m.K_b);
  expect_covers(f().armature.at("R_a"), m.R_a);
  expect_covers(f().generator.at("K_b"), m.K_b);
  expect_covers(f().friction.at("B"), m.B);
  expect_covers(f().friction.at("T_c"), plant().friction.T_c);
  expect_covers(f().machine_line.at("slope"), -(m.K_m * m.K_b / m.R_a + m.B));
  expect_covers(f().torque_constant.at("K_m"), m.K_m + m.B * m.R_a / m.K_b);
  expect_covers(f().torque_constant.at("T_0"), plant().friction.T_c + m.B * 110 / m.K_b);
  expect_covers(f().driver_slopes.at("rise"), 22.5);
  expect_covers(f().driver_slopes.at("fall"), -20.4);
  expect_covers(f().driver_gain.at("gain"), 110.0 / 6);
}

TEST_F(Paper, Figure5FollowsTheBrakeAndNotTheFriction) {
  EXPECT_NEAR(f().brake_line.at("slope").value, printed::B, 0.1 * printed::B);
  EXPECT_NEAR(f().brake_line.at("intercept").value, printed::T_L, 0.01 * printed::T_L);
  for (const auto& [B, slope] : f().brake_slope_against_B) {
    EXPECT_NEAR(slope, printed::B, 0.6 * printed::B) << "of a motor with B = " << B;
  }
}

TEST_F(Paper, AGaugeExplainsTheTorqueConstantAndFrictionDoesNot) {
  ASSERT_EQ(f().torque_constants.size(), 8U);
  for (std::size_t n = 0; n < 3; ++n) EXPECT_GT(f().torque_constants[n].K_m, printed::K_b);
  const TorqueConstantCase& gauge = f().torque_constants[3];
  EXPECT_NEAR(gauge.K_m, printed::K_m, 0.01 * printed::K_m);
  EXPECT_NEAR(gauge.R_a, printed::R_a, 0.01 * printed::R_a);
  for (std::size_t n = 4; n < 8; ++n) {
    EXPECT_LT(f().torque_constants[n].K_m, 0.9 * printed::K_b);
    EXPECT_LT(f().torque_constants[n].R_a, 0.85 * printed::R_a) << "pulses spoil R_a, too";
  }
}

TEST_F(Paper, MissingFrictionMovesBAndJOnARisingStepOnly) {
  const auto& m = plant().motor;
  EXPECT_GT(f().both_parameters.at("B"), 4 * m.B);
  EXPECT_GT(f().both_parameters.at("J"), 1.2 * m.J);
  EXPECT_NEAR(f().with_falling_step.at("J"), m.J, 0.01 * m.J);
  EXPECT_GT(f().with_falling_step.at("B"), 4 * m.B);
  for (const OutputErrorFit* fit : {&f().with_friction_rising, &f().with_friction_both}) {
    EXPECT_NEAR(fit->at("J"), m.J, 0.005 * m.J);
    EXPECT_NEAR(fit->at("B"), m.B, 0.05 * m.B);
    EXPECT_NEAR(fit->at("coulomb_friction.T_c"), plant().friction.T_c, 0.02 * plant().friction.T_c);
    EXPECT_LT(fit->error, 1.1) << "noise is all that is left";
  }
}

TEST_F(Paper, TheFrictionSaidToGiveTable1DoesGiveIt) {
  simulated::Setup setup = f().gauge;
  const double gauge = printed::K_m / printed::K_b;
  setup.plant.friction.T_c = f().needed_T_c / gauge;
  setup.plant.motor.B = f().needed_B / gauge;
  const Model model = freed(linear_model(printed::R_a, printed::K_b, printed::K_m, printed::B, printed::J),
                            {{"B", 0, 0.01}, {"J", 2e-4, 0.1}});
  const OutputErrorFit fitted = fit("", {step_up(setup)}, speed_only, model);
  EXPECT_NEAR(fitted.gain(), f().printed_gain, 1e-3 * f().printed_gain);
  EXPECT_NEAR(fitted.time_constant(), f().printed_time_constant, 1e-3 * f().printed_time_constant);
}

TEST_F(Paper, OneSpeedFixesTwoOfFiveParameters) {
  ASSERT_EQ(f().identifiability.size(), 4U);
  const std::size_t determined[] = {2, 2, 4, 5};
  for (std::size_t n = 0; n < 4; ++n) {
    EXPECT_EQ(f().identifiability[n].fit.determined, determined[n]) << f().identifiability[n].data;
  }
  for (const OutputErrorFit& fit : f().starts) EXPECT_NEAR(fit.error, f().starts[0].error, 1e-3);
  EXPECT_LT(f().unbounded[1].at("R_a"), 0) << "as the paper saw";
  EXPECT_LT(f().unbounded[2].at("J"), 0);
  for (std::size_t n = 0; n < 3; ++n) EXPECT_NEAR(f().unbounded[n].error, f().starts[0].error, 1e-3);
}

TEST_F(Paper, InertiaIsFoundByMethodsThatHold) {
  ASSERT_EQ(f().inertias.size(), 6U);
  EXPECT_LT(f().inertias[0].J, 0.6 * plant().motor.J) << "a slow meter hides the peak";
  for (std::size_t n = 2; n < 6; ++n) {
    EXPECT_NEAR(f().inertias[n].J, plant().motor.J, 0.015 * plant().motor.J) << f().inertias[n].name;
  }
  EXPECT_LT(f().driver_acceleration, 22.5 / printed::K_b);
}

struct Piece {
  std::string text;
  double number = 0;
  double last_digit = 0;  ///< what one unit of it is worth; 0: no number
};

/// A text cut into numbers and what stands between them.
std::vector<Piece> pieces(const std::string& text) {
  static const std::regex number(R"(\d+(\.\d+)?)");
  std::vector<Piece> all;
  std::size_t end = 0;
  for (std::sregex_iterator it(text.begin(), text.end(), number), none; it != none; ++it) {
    const auto at = static_cast<std::size_t>(it->position());
    all.push_back({.text = text.substr(end, at - end)});
    const std::string digits = it->str();
    const std::size_t point = digits.find('.');
    const auto decimals = point == std::string::npos ? 0.0 : static_cast<double>(digits.size() - point - 1);
    all.push_back({.text = digits, .number = std::stod(digits), .last_digit = std::pow(10, -decimals)});
    end = at + digits.size();
  }
  all.push_back({.text = text.substr(end)});
  return all;
}

/// docs/paper.md is what the command writes; numbers may differ in their last digits on another processor.
TEST_F(Paper, ThePageInTheTreeIsTheOneThatIsWritten) {
  const std::filesystem::path docs = std::filesystem::path(EMTB_SOURCE_DIR) / "docs";
  std::ifstream file(docs / "paper.md");
  const std::string in_tree{std::istreambuf_iterator<char>(file), {}};
  std::istringstream left(in_tree), right(page(f()));
  std::string expected, written;
  while (std::getline(left, expected)) {
    ASSERT_TRUE(std::getline(right, written)) << "the page ends before: " << expected;
    if (expected.starts_with("| J = 1 ")) continue;  // a search that loses its way loses it differently elsewhere
    const std::vector<Piece> a = pieces(expected), b = pieces(written);
    ASSERT_EQ(a.size(), b.size()) << expected << "\n" << written;
    for (std::size_t k = 0; k < a.size(); ++k) {
      if (a[k].last_digit == 0) {
        ASSERT_EQ(a[k].text, b[k].text) << "run emtb paper --out docs";
      } else {
        ASSERT_NEAR(a[k].number, b[k].number, 0.02 * a[k].number + 2 * a[k].last_digit)
            << "run emtb paper --out docs: " << expected;
      }
    }
  }
  EXPECT_FALSE(std::getline(right, written)) << "the tree's page lacks: " << written;
  for (const auto& [name, figure] : pictures(f())) {
    EXPECT_THAT(in_tree, HasSubstr("pictures/paper/" + name + ".svg"));
    EXPECT_TRUE(std::filesystem::exists(docs / "pictures" / "paper" / (name + ".svg"))) << name;
    EXPECT_FALSE(figure.description.empty()) << name;
  }
}

TEST_F(Paper, TheSameFindingsGiveTheSameBytes) { EXPECT_EQ(page(f()), page(find())); }

}  // namespace
}  // namespace emtb::paper
