#include "analysis/diagnose/plausibility.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>

#include "analysis/diagnose/fitted_trials.h"
#include "analysis/diagnose/told_from_nothing.h"
#include "analysis/fit/calibrate.h"
#include "analysis/record/supply.h"
#include "model/catalogue.h"
#include "tests/analysis/diagnose/answers.h"
#include "tests/analysis/synthetic.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using namespace answers;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

const Dataset& data_of_the_servo() {
  static const Dataset data =
      prepare(record(blind::fast_bench(), blind::fast_bench().train, 1), {}, blind::fast_bench().model);
  return data;
}

/// The servo as it is, with an effect of these values.
Model servo_with(std::string_view id, const std::vector<double>& values) {
  Model model = blind::fast_bench().model;
  const auto& motor = blind::fast_bench().plant.motor;
  model.at(base::R_a).value = motor.R_a;
  model.at(base::K_b).value = motor.K_b;
  model.at(base::B).value = motor.B;
  model.at(base::J).value = motor.J;
  model.include(effect_index(id));
  for (std::size_t i = 0; i < values.size(); ++i) model.parameters_of(effect_index(id))[i].value = values[i];
  return model;
}

std::string said_of(std::string_view id, const std::vector<double>& values) {
  return implausible_value(data_of_the_servo().train, servo_with(id, values), effect_index(id));
}

/// Is a limit told, found so in a driver that is known to move at 200 V/s?
bool told(double rise, double error) {
  Fit fit{.model = servo_with("driver_slew", {rise, 200}), .cost = 1, .at_bound = {}, .phases = {}};
  fit.model.driver = DriverModel{.gain = 4, .rise = 200, .fall = 200};
  for (Parameter& p : fit.model.parameters_of(effect_index("driver_slew"))) p.std_error = error;
  return told_from_zero(fit, effect_index("driver_slew"));
}

TEST(Plausibility, ASupplyGivesNoMoreThanIsKnownOfIt) {
  const Model& model = blind::fast_bench().model;
  const double known = supply_of(data_of_the_servo().train, model);
  EXPECT_THAT(said_of("driver_saturation", {1.3 * known}), HasSubstr("the driver's known limit"));
  EXPECT_EQ(said_of("driver_saturation", {0.9 * known}), "");
}

TEST(Plausibility, ALimitIsToldFromTheOneThatIsKnown) {
  EXPECT_TRUE(told(150, 5));
  EXPECT_FALSE(told(205, 5));
  EXPECT_FALSE(told(1e6, 8e5)) << "nothing moves as fast";
}

TEST(Plausibility, ASizeIsToldFromNothingByAsManyErrorsAsAreAsked) {
  Fit fit{.model = servo_with("coulomb_friction", {0.004}), .cost = 1, .at_bound = {}, .phases = {}};
  fit.model.parameters_of(effect_index("coulomb_friction"))[0].std_error = 0.001;
  EXPECT_TRUE(told_from_zero(fit, effect_index("coulomb_friction"), 3));
  EXPECT_FALSE(told_from_zero(fit, effect_index("coulomb_friction"), 5));
}

TEST(Plausibility, KnowsTheMachineAndHowFarItWent) {
  const FittedMachine machine = machine_of(data_of_the_servo().train, servo_with("coulomb_friction", {0}));
  EXPECT_NEAR(machine.seen.voltage, 20, 0.5);
  EXPECT_NEAR(machine.seen.speed, 20 / 0.042, 20);
  EXPECT_NEAR(machine.stall_torque(), 0.042 * 20 / 1.2, 0.02);
  EXPECT_NEAR(machine.time_constant(), 6e-5 * 1.2 / (0.042 * 0.042), 2e-3);
}

TEST(Plausibility, SaysWhichValueIsBeyondWhat) {
  EXPECT_THAT(said_of("friction_warmup", {0.4, 0.19}), HasSubstr("tau is 0.19 s, not above 10 s"));
  EXPECT_THAT(said_of("shaft_compliance", {5, 1e-3, 6.1e-5}), HasSubstr("J_2 is 6.1e-05 kg m2, not below"));
  EXPECT_THAT(said_of("eddy_brake", {0.02, 0.019}), HasSubstr("omega_b is 0.019 rad/s, not above"));
  EXPECT_THAT(said_of("armature_inductance", {1.5}), HasSubstr("L_a/R_a is 1.25 s"));
  EXPECT_THAT(said_of("tacho_offset", {-448}), HasSubstr("omega_0 is -448 rad/s"));
  EXPECT_THAT(said_of("load_torque", {-61}), HasSubstr("stalls the motor"));
}

TEST(Plausibility, HasNothingAgainstWhatABenchMayHave) {
  EXPECT_EQ(said_of("friction_warmup", {0.4, 30}), "");
  EXPECT_EQ(said_of("shaft_compliance", {5, 1e-3, 2e-5}), "");
  EXPECT_EQ(said_of("eddy_brake", {0.02, 200}), "");
  EXPECT_EQ(said_of("armature_inductance", {2e-3}), "");
  EXPECT_EQ(said_of("tacho_offset", {-1.5}), "");
  EXPECT_EQ(said_of("load_torque", {-0.01}), "");
}

TEST(Plausibility, AnAmplitudeThatRestsOnItsBoundIsNotItsSize) {
  Model model = servo_with("coulomb_friction", {0.003});
  Parameter& T_c = model.parameters_of(effect_index("coulomb_friction"))[0];
  T_c.max = 0.003;
  EXPECT_THAT(implausible_value(data_of_the_servo().train, model, effect_index("coulomb_friction")),
              HasSubstr("a bound beyond which it would go"));
  T_c.fixed = true;
  EXPECT_EQ(implausible_value(data_of_the_servo().train, model, effect_index("coulomb_friction")), "")
      << "held there by hand";
  EXPECT_EQ(said_of("coulomb_friction", {0}), "") << "absent";
  Model soft = servo_with("shaft_compliance", {1e-3, 1e-5, 1e-6});
  soft.parameters_of(effect_index("shaft_compliance"))[0].min = 1e-3;
  EXPECT_THAT(implausible_value(data_of_the_servo().train, soft, effect_index("shaft_compliance")),
              HasSubstr("k is 0.001 N m/rad, not above 0.001 N m/rad, a bound beyond which it would go"))
      << "absent is at infinity";
}

using OverAngleAndTime = std::function<double(double, double)>;

/// A run of 0.1 s, in which the servo turns by half a turn at most.
emtb::Run half_a_turn(double begins_at, const OverAngleAndTime& torque, unsigned seed) {
  constexpr double h = 1e-5, row = 5e-4, R_a = 1.2, K = 0.042, B = 1.2e-5, J = 2e-4;
  constexpr int rows = 200, steps = 50;
  synthetic::Noise noise(seed);
  emtb::Run run;
  run.name = "half a turn";
  double theta = begins_at, omega = 0;
  for (int k = 0; k < rows; ++k) {
    const double t = k * row, u = k < 20 ? 0 : 3 + 0.3 * (seed % 4);
    for (const auto& [signal, value] : std::map<Signal, double>{{Signal::e_a, u},
                                                                {Signal::omega, omega + noise(0.02)},
                                                                {Signal::i_a, (u - K * omega) / R_a + noise(0.005)}}) {
      run.signals[signal].t.push_back(t);
      run.signals[signal].value.push_back(value);
    }
    for (int s = 0; s < steps; ++s) {
      omega += h / J * (K * (u - K * omega) / R_a - B * omega - torque(theta, t + s * h));
      theta += h * omega;
    }
  }
  return run;
}

Diagnosis of_half_turns(const std::function<OverAngleAndTime(unsigned)>& torque) {
  std::vector<emtb::Run> train, held_out;
  for (unsigned seed = 1; seed <= 6; ++seed) {
    (seed < 5 ? train : held_out).push_back(half_a_turn(2.1 * seed, torque(seed), seed));
  }
  Model model = synthetic::servo_model();
  model.input = Signal::e_a;
  return diagnose(train, held_out, model);
}

TEST(Plausibility, AWeightThatExplainsAllOfPartsOfATurnIsNamed) {
  const Diagnosis d =
      of_half_turns([](unsigned) { return [](double theta, double) { return 0.03 * std::sin(theta); }; });
  EXPECT_THAT(named(d), testing::ElementsAre("eccentric_load")) << report(d);
  EXPECT_NEAR(fitted(d, "T_e"), 0.03, 0.001);
}

TEST(Plausibility, AWeightThatExplainsLittleOfAForceThatDriftsIsNotNamed) {
  const Diagnosis d = of_half_turns([](unsigned seed) {
    return [seed](double, double t) { return 0.02 * std::sin(90 * t + 2 * seed) + 0.015 * std::sin(170 * t + seed); };
  });
  EXPECT_THAT(named_or_tied(d), Not(Contains("eccentric_load"))) << report(d);
}

TEST(Plausibility, AWeightHangsStraightDownBeforeItIsSwungInASingleRun) {
  Model model = synthetic::servo_model();
  model.input = Signal::e_a;
  model.include(effect_index("eccentric_load"));
  const auto said_in_one_run = [&](const OverAngleAndTime& torque) {
    const Dataset data = prepare(std::vector{half_a_turn(0, torque, 3)}, {}, model);
    return implausible_value(data.train, calibrate(data.train, model).model, effect_index("eccentric_load"));
  };
  EXPECT_EQ(said_in_one_run([](double theta, double) { return 0.03 * std::sin(theta); }), "");
  EXPECT_THAT(said_in_one_run([](double theta, double) { return 0.03 * std::cos(theta) - 0.03; }),
              HasSubstr("no run makes a whole turn"))
      << "something holds it on one side";
}

TEST(Plausibility, AFieldThatHeatsInASecondIsNotNamedAndTheReasonIsTold) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.motor.field_drop = 0.05;
  bench.plant.motor.field_time = 1.5;  // [s] of no winding
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named_or_tied(d), Not(Contains("field_heating"))) << report(d);
  const auto refused =
      std::ranges::find(d.candidates, effect_index("field_heating"), [](const Candidate& c) { return c.score.effect; });
  ASSERT_NE(refused, d.candidates.end());
  EXPECT_THAT(refused->implausible, HasSubstr("not above 10 s")) << report(d);
  bench.plant.motor.field_time = 20;
  EXPECT_THAT(named(diagnose_on(bench)), Contains("field_heating"));
}

}  // namespace
}  // namespace emtb
