#include "config/formula_effect.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/fit/calibrate.h"
#include "analysis/record/dataset.h"
#include "config/formula.h"
#include "model/catalogue.h"
#include "tests/analysis/synthetic.h"
#include "tests/model/benches.h"
#include "tests/model/check_sensitivities.h"

namespace emtb {
namespace {

/// A formula with its parameters, and where it acts.
struct UsersEffect {
  TermPlace place;
  std::string formula;
  std::vector<CheckedParameter> parameters;

  std::shared_ptr<const Term> term() const {
    std::vector<std::string> symbols;
    for (const CheckedParameter& p : parameters) symbols.push_back(p.name);
    return parse_formula(formula, symbols);
  }
};

SensitivityCase case_with(const testing_benches::TestBench& bench, const std::vector<UsersEffect>& effects) {
  SensitivityCase c{bench.structure, {}, bench.excitation};
  for (std::size_t i = 0; i < bench.base.size(); ++i) {
    c.parameters.push_back({std::string(base_parameters[i].symbol), bench.base[i], bench.base[i], 0, 1e9});
  }
  for (const UsersEffect& e : effects) {
    c.structure.terms.push_back({e.place, e.term(), e.parameters.size()});
    c.parameters.insert(c.parameters.end(), e.parameters.begin(), e.parameters.end());
  }
  return c;
}

TEST(FormulaInAModel, HasTheRightSensitivities) {
  const double far = 1e9;
  for (const testing_benches::TestBench& bench : {testing_benches::slow_bench(), testing_benches::fast_bench()}) {
    SCOPED_TRACE(bench.name);
    const double torque = bench.typical.at("coulomb_friction.T_c");
    const UsersEffect cubic{TermPlace::torque, "-c3*omega^3", {{"c3", 1e-6 * torque, 1e-6 * torque, -far, far}}};
    const UsersEffect smooth{TermPlace::torque,
                             "-T*tanh(omega/w)*exp(-t/tau)",
                             {{"T", torque, torque, -far, far}, {"w", 8, 8, 1, far}, {"tau", 20, 20, 1, far}}};
    const UsersEffect drop{TermPlace::voltage, "-V*tanh(i_a/2)", {{"V", 0.2, 0.2, -far, far}}};
    const UsersEffect steep{TermPlace::voltage,
                            "-V*tanh(i_a/i_k) - r*i_a",
                            {{"V", 0.4, 0.4, -far, far}, {"i_k", 0.02, 0.02, 1e-3, far}, {"r", 0.3, 0.3, -far, far}}};
    const UsersEffect field{TermPlace::flux, "1 - k*i_a^2/(1 + i_a^2)", {{"k", 0.05, 0.05, -far, far}}};
    EXPECT_TRUE(CheckSensitivities(case_with(bench, {cubic}), 1e-6));
    for (const UsersEffect& effect : {smooth, drop, steep, field})
      EXPECT_TRUE(CheckSensitivities(case_with(bench, {effect})));
    EXPECT_TRUE(CheckSensitivities(case_with(bench, {smooth, drop, field})));
    UsersEffect absent = cubic;
    absent.parameters[0].value = 0;
    EXPECT_TRUE(CheckSensitivities(case_with(bench, {absent}), 1e-6)) << "where a score test stands";
  }
}

/// A formula that remembers, as a file of candidates says it.
AddedTerm remembering(const std::string& formula, const std::string& rate, const std::string& parameters) {
  const std::string text = "own: {" + formula + ", memory: {z: \"" + rate + "\"}, parameters: " + parameters + "}";
  return read_formula(YamlMap::parse(text, "own.yaml"), "own");
}

SensitivityCase case_with(const testing_benches::TestBench& bench, const AddedTerm& term) {
  SensitivityCase c = case_with(bench, std::vector<UsersEffect>{});
  c.structure.terms.push_back(term.placed());
  for (const Parameter& p : term.parameters) c.parameters.push_back({p.symbol, p.value, p.value, p.min, p.max});
  return c;
}

TEST(FormulaInAModel, HasTheRightSensitivitiesWhereItRemembers) {
  for (const testing_benches::TestBench& bench : {testing_benches::slow_bench(), testing_benches::fast_bench()}) {
    SCOPED_TRACE(bench.name);
    const std::string torque = std::to_string(bench.typical.at("coulomb_friction.T_c"));
    const std::string of_torque = "a: {value: " + torque + ", min: -10, max: 10}";
    const AddedTerm late = remembering("torque: -a*z", "(tanh(omega/w) - z)/tau",
                                       "{" + of_torque +
                                           ", w: {value: 8, min: 1, max: 100}, tau: {value: 0.05, min: 0.01, "
                                           "max: 2}}"),
                    giving = remembering("torque: -a*z", "(omega - abs(omega)*z)/w",
                                         "{" + of_torque + ", w: {value: 30, min: 1, max: 100}}"),
                    heated = remembering("flux: 1 - k*z", "(i_a^2/(1 + i_a^2) - z)/tau",
                                         "{k: {value: 0.1, min: 0, max: 0.5}, tau: {value: 0.4, min: 0.1, max: 2}}"),
                    behind = remembering("voltage: -r*z", "(i_a - z)/tau",
                                         "{r: {value: 0.1, min: 0, max: 1}, tau: {value: 0.03, min: 0.01, max: 2}}");
    for (const AddedTerm& term : {late, giving, heated, behind}) {
      EXPECT_TRUE(CheckSensitivities(case_with(bench, term))) << term.info->equation;
    }
  }
}

/// The speed of a bench with a term.
std::vector<double> speed_with(const testing_benches::TestBench& bench, const AddedTerm& term, Excitation excitation) {
  ModelStructure structure = bench.structure;
  structure.terms = {term.placed()};
  std::vector<double> values = bench.base;
  for (const Parameter& p : term.parameters) values.push_back(p.value);
  Trajectory<double> y;
  simulate<double>(structure, values, excitation, y);
  return y.omega;
}

TEST(FormulaInAModel, WhatIsForgottenWithinAStepIsAsGoodAsNotRemembered) {
  const testing_benches::TestBench bench = testing_benches::fast_bench();
  const AddedTerm at_once = remembering("torque: -a*z", "(tanh(omega/20) - z)/tau",
                                        "{a: {value: 0.002, min: 0, max: 1}, tau: {value: 1.0e-9, min: 1.0e-12, max: "
                                        "1}}");
  const AddedTerm none = read_formula(
      YamlMap::parse("own: {torque: -a*tanh(omega/20), parameters: {a: {value: 0.002, min: 0, max: 1}}}", "own.yaml"),
      "own");
  const auto y = speed_with(bench, at_once, bench.excitation), expected = speed_with(bench, none, bench.excitation);
  ASSERT_GT(y.size(), 1000U);
  for (std::size_t k = 0; k < y.size(); ++k) ASSERT_NEAR(y[k], expected[k], 1e-6) << bench.excitation.t[k] << " s";
}

TEST(FormulaInAModel, ARunThatBeginsInMotionRemembersWhatLastsThere) {
  testing_benches::TestBench bench = testing_benches::fast_bench();
  Excitation spinning = bench.excitation;
  spinning.initial.omega = 200;
  const AddedTerm slow = remembering("torque: -a*z", "(tanh(omega/5) - z)/tau",
                                     "{a: {value: 0.002, min: 0, max: 1}, tau: {value: 1.0e6, min: 1, max: 1.0e7}}");
  const AddedTerm constant = read_formula(
      YamlMap::parse("own: {torque: -a, parameters: {a: {value: 0.002, min: 0, max: 1}}}", "own.yaml"), "own");
  const auto y = speed_with(bench, slow, spinning), expected = speed_with(bench, constant, spinning);
  for (std::size_t k = 0; k < 1000; ++k) ASSERT_NEAR(y[k], expected[k], 1e-4) << "it never forgets the first speed";
  EXPECT_GT(
      std::abs(speed_with(bench, slow, bench.excitation)[500] - speed_with(bench, constant, bench.excitation)[500]),
      0.1)
      << "from rest it remembers nothing";
}

TEST(FormulaInAModel, ADropThatIsSteepInTheCurrentDoesNotSwing) {
  const testing_benches::TestBench bench = testing_benches::fast_bench();
  const auto simulated_with = [&](const ModelStructure& structure, std::vector<double> more) {
    std::vector<double> values = bench.base;
    values.insert(values.end(), more.begin(), more.end());
    Trajectory<double> y;
    simulate<double>(structure, values, bench.excitation, y);
    return y;
  };
  ModelStructure library = bench.structure, formula = bench.structure, jump = bench.structure;
  library.effects = {effect_index("brush_drop")};
  formula.terms = {
      {TermPlace::voltage, parse_formula("-V*tanh(i_a/i_lin)", std::vector<std::string>{"V", "i_lin"}), 2}};
  jump.terms = {{TermPlace::voltage, parse_formula("-V*sign(i_a)", std::vector<std::string>{"V"}), 1}};
  const auto expected = simulated_with(library, {0.4, 0.02}), y = simulated_with(formula, {0.4, 0.02});
  const auto held = simulated_with(jump, {0.4}), sharp = simulated_with(formula, {0.4, 1e-5});
  ASSERT_GT(y.omega.size(), 1000U);
  for (std::size_t k = 0; k < y.omega.size(); ++k) {
    ASSERT_NEAR(y.omega[k], expected.omega[k], 1e-6) << "of 600 rad/s, at t = " << bench.excitation.t[k] << " s";
    ASSERT_NEAR(held.omega[k], sharp.omega[k], 0.05) << "at t = " << bench.excitation.t[k] << " s";
  }
  for (std::size_t k = y.i_a.size() - 100; k < y.i_a.size(); ++k) {
    ASSERT_NEAR(y.i_a[k], expected.i_a[k], 1e-9);
    ASSERT_NEAR(held.i_a[k], sharp.i_a[k], 1e-3);
  }
}

constexpr double windage_size = 2e-8;  // [N m s2/rad2]

Model with_windage_of_the_library() {
  Model m = synthetic::servo_model();
  m.include(effect_index("windage"));
  m.parameters_of(effect_index("windage"))[0].value = windage_size / 3;
  return m;
}

Model with_windage_as_a_formula() {
  Model m = synthetic::servo_model();
  Parameter c2 = with_windage_of_the_library().parameters_of(effect_index("windage"))[0];
  c2.symbol = "c2";
  m.terms.push_back({.name = "my_windage",
                     .place = TermPlace::torque,
                     .term = parse_formula("-c2*omega*abs(omega)", std::vector<std::string>{"c2"}),
                     .parameters = {c2},
                     .formula = "-c2*omega*abs(omega)",
                     .memory = {},
                     .rate_formula = {},
                     .rate = {},
                     .info = {}});
  return m;
}

TEST(FormulaInAModel, SimulatesAsTheSameEffectOfTheLibraryDoes) {
  const Excitation x = testing_benches::fast_bench().excitation;
  Trajectory<double> built_in, formula;
  simulate<double>(with_windage_of_the_library().structure(), with_windage_of_the_library().values(), x, built_in);
  simulate<double>(with_windage_as_a_formula().structure(), with_windage_as_a_formula().values(), x, formula);
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    ASSERT_NEAR(formula.omega[k], built_in.omega[k], 1e-9);
    ASSERT_NEAR(formula.i_a[k], built_in.i_a[k], 1e-9);
  }
  EXPECT_GT(std::abs(built_in.omega[1500]), 50) << "it does turn";
}

TEST(FormulaInAModel, CalibratesAsTheSameEffectOfTheLibraryDoes) {
  Model truth = with_windage_of_the_library();
  truth.parameters_of(effect_index("windage"))[0].value = windage_size;
  const Excitation x = testing_benches::fast_bench().excitation;
  Trajectory<double> y;
  simulate<double>(truth.structure(), truth.values(), x, y);
  synthetic::Noise noise(5);
  emtb::Run run;
  run.name = "with windage";
  for (std::size_t k = 0; k < x.t.size(); ++k) {
    const auto add = [&](Signal s, double value) {
      run.signals[s].t.push_back(x.t[k]);
      run.signals[s].value.push_back(value);
    };
    add(Signal::u_ref, x.u_ref[k]);
    add(Signal::i_a, y.i_a[k] + noise(0.01));
    add(Signal::omega, y.omega[k] + noise(0.1));
  }
  const auto fitted = [&](Model model) {
    for (Parameter& p : model.base) p.value *= 1.1;
    model.noise = {{Signal::omega, 0.1}, {Signal::i_a, 0.01}};
    const std::vector<Record> records = prepare(std::vector{run}, {}, model).train;
    return calibrate(records, model).model;
  };
  const Model built_in = fitted(with_windage_of_the_library()), formula = fitted(with_windage_as_a_formula());
  ASSERT_EQ(built_in.names().size(), 6U);
  EXPECT_NEAR(built_in.at(5).value, windage_size, 0.1 * windage_size);
  for (std::size_t i = 0; i < built_in.names().size(); ++i) {
    SCOPED_TRACE(built_in.names()[i]);
    EXPECT_NEAR(formula.at(i).value, built_in.at(i).value, 1e-6 * built_in.at(i).value);
    ASSERT_EQ(formula.at(i).std_error.has_value(), built_in.at(i).std_error.has_value());
    if (built_in.at(i).std_error) {
      EXPECT_NEAR(*formula.at(i).std_error, *built_in.at(i).std_error, 1e-5 * *built_in.at(i).std_error);
    }
  }
}

}  // namespace
}  // namespace emtb
