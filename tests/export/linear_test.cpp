#include "export/linear.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <nlohmann/json.hpp>

#include "hal/error.h"
#include "tests/export/models.h"

namespace emtb {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Eigen::MatrixXd matrix(const std::vector<std::vector<double>>& rows) {
  Eigen::MatrixXd m(rows.size(), rows[0].size());
  for (Eigen::Index r = 0; r < m.rows(); ++r) {
    for (Eigen::Index c = 0; c < m.cols(); ++c)
      m(r, c) = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  }
  return m;
}

double polynomial(const std::vector<double>& c, double s) {
  double sum = 0;
  for (const double one : c) sum = sum * s + one;
  return sum;
}

TEST(Linearise, LeavesALinearMachineAsItIs) {
  const Model model = with(with(linear_model(), "armature_inductance"), "driver_output_resistance");
  const LinearMachine m = linearise(model, {.omega = 40, .load = 0.1});
  const std::vector<double> p = model.values();
  EXPECT_NEAR(m.R, p[base::R_a] + model.parameters_of(effect_index("driver_output_resistance"))[0].value, 1e-6);
  EXPECT_NEAR(m.K_b, p[base::K_b], 1e-9);
  EXPECT_NEAR(m.K_m, p[base::K_m], 1e-9);
  EXPECT_NEAR(m.B, p[base::B], 1e-9);
  EXPECT_NEAR(m.J, p[base::J], 1e-15);
  EXPECT_NEAR(m.gain, 18.3333333, 1e-6);
  EXPECT_NEAR(m.i_a, (p[base::B] * 40 + 0.1) / p[base::K_m], 1e-9);
  EXPECT_THAT(not_linear(model), IsEmpty());
}

TEST(Linearise, TakesTheSlopeOfWhatBends) {
  const Model model = with(linear_model(), "windage");
  const double c_w = model.parameters_of(effect_index("windage"))[0].value, B = model.values()[base::B];
  EXPECT_NEAR(linearise(model, {.omega = 100}).B, B + 2 * c_w * 100, 1e-8);
  EXPECT_NEAR(linearise(model, {.omega = -100}).B, B + 2 * c_w * 100, 1e-8);
  EXPECT_THAT(not_linear(model), ElementsAre("windage"));
  EXPECT_THAT(not_linear(with(linear_model(), "coulomb_friction")), ElementsAre("coulomb_friction"));
}

TEST(Linearise, RefusesWhatHasNoPlaceInIt) {
  EXPECT_THROW(linearise(with(linear_model(), "coulomb_friction"), {.omega = 0}), ModelError);
  EXPECT_NO_THROW(linearise(with(linear_model(), "coulomb_friction"), {.omega = 1}));
  EXPECT_THROW(linearise(with(linear_model(), "armature_heating"), {.omega = 10}), ModelError);
}

TEST(TopSpeed, IsWhereTheVoltageEnds) {
  const Model model = linear_model();
  const std::vector<double> p = model.values();
  EXPECT_NEAR(top_speed(model), 110 / (p[base::K_b] + p[base::R_a] * p[base::B] / p[base::K_m]), 1e-6);
  EXPECT_LT(top_speed(with(model, "coulomb_friction")), top_speed(model) - 1);
}

TEST(StateSpace, HasTheTransferFunctionsOfTheSameMachine) {
  for (const bool lags : {false, true}) {
    for (const bool inductive : {false, true}) {
      Model model = linear_model();
      if (inductive) model = with(model, "armature_inductance");
      if (lags) model = with(model, "driver_lag");
      const LinearMachine m = linearise(model, {.omega = 20});
      const StateSpace s = state_space(m, model.input);
      ASSERT_EQ(s.states.size(), 1U + lags + inductive);
      for (const TransferFunction& f : transfer_functions(m, model.input)) {
        const Eigen::Index in = f.from == "load" ? 1 : 0, out = f.to == "omega" ? 0 : 1;
        for (const double at : {0.0, 0.7, 30.0}) {
          const Eigen::MatrixXd A = matrix(s.A), I = Eigen::MatrixXd::Identity(A.rows(), A.cols());
          const Eigen::MatrixXd y = matrix(s.C) * (at * I - A).inverse() * matrix(s.B) + matrix(s.D);
          const double expected = polynomial(f.numerator, at) / polynomial(f.denominator, at);
          EXPECT_NEAR(y(out, in), expected, 1e-9 * std::abs(expected)) << f.from << " to " << f.to << " at " << at;
        }
      }
    }
  }
}

TEST(StateSpaceJson, CarriesTheParametersErrorsOver) {
  Model model = linear_model();
  model.at(base::J).std_error = 0.01 * model.at(base::J).value;
  const json s = json::parse(state_space_json(model, {.omega = std::numeric_limits<double>::quiet_NaN()}));
  EXPECT_NEAR(s["std_error"]["B"][0][0].get<double>() / s["B"][0][0].get<double>(), 0.01, 1e-4);
  EXPECT_EQ(s["std_error"]["C"][1][0], 0) << "-K_b/R does not depend on J";
  EXPECT_TRUE(s["covariance"].is_null());
  EXPECT_THAT(s["left_out"][0].get<std::string>(), HasSubstr("22.5 and 20.4 V/s"));
  const json t = json::parse(transfer_functions_json(model, {.omega = 0}));
  EXPECT_EQ(t["transfer_functions"].size(), 4U);
  EXPECT_GT(t["transfer_functions"][0]["denominator_std_error"][0].get<double>(), 0);
}

}  // namespace
}  // namespace emtb
