#include "analysis/fit/calibrate.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "analysis/numerics/parallel.h"
#include "analysis/record/dataset.h"
#include "hal/error.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

using synthetic::record;
using synthetic::servo_model;
using synthetic::Truth;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

constexpr synthetic::Sigma quiet{.omega = 0.1, .i_a = 0.01, .e_a = 0.02};

std::vector<Record> prepared(const std::vector<emtb::Run>& runs, const Model& model) {
  return prepare(runs, {}, model).train;
}

Model with_noise(Model model) {
  model.noise = {{Signal::omega, quiet.omega}, {Signal::i_a, quiet.i_a}, {Signal::e_a, quiet.e_a}};
  return model;
}

/// The speed alone, from the reference.
emtb::Run speed_only(emtb::Run run) {
  run.signals.erase(Signal::i_a);
  run.signals.erase(Signal::e_a);
  return run;
}

void expect_truth(const Model& fitted, double tolerance) {
  const Truth truth;
  EXPECT_NEAR(fitted.at(0).value, truth.R_a, tolerance * truth.R_a);
  EXPECT_NEAR(fitted.at(1).value, truth.K_b, tolerance * truth.K_b);
  EXPECT_EQ(fitted.at(2).value, fitted.at(1).value);
  EXPECT_NEAR(fitted.at(3).value, truth.B, 10 * tolerance * truth.B);
  EXPECT_NEAR(fitted.at(4).value, truth.J, tolerance * truth.J);
}

TEST(Calibrate, RecoversTheTruthBehindARecording) {
  const Model model = with_noise(servo_model());
  const Calibration c = calibrate(prepared({record({}, synthetic::steps, 1e-3, quiet)}, model), model);
  expect_truth(c.model, 0.005);
  EXPECT_TRUE(c.converged);
  EXPECT_THAT(c.at_bound, IsEmpty());
  EXPECT_THAT(c.identifiability.undetermined, IsEmpty());
  for (const std::size_t place : {0U, 1U, 3U, 4U}) {
    ASSERT_TRUE(c.model.at(place).std_error);
    EXPECT_LT(*c.model.at(place).std_error, 0.1 * c.model.at(place).value);
  }
  EXPECT_FALSE(c.model.at(2).std_error) << "follows K_b";
}

TEST(Calibrate, RecoversTheTruthFromTheSpeedAndAMeterThatAverages) {
  emtb::Run run = record({}, synthetic::steps, 1e-3, {.omega = 0.1});
  const Series fast = run.at(Signal::i_a);
  Series meter;
  for (std::size_t k = 400; k < fast.t.size(); k += 400) {
    double sum = 0;
    for (std::size_t j = k - 399; j <= k; ++j) sum += 0.5 * (fast.value[j - 1] + fast.value[j]);
    meter.t.push_back(fast.t[k]);
    meter.value.push_back(sum / 400);
  }
  meter.window = 0.4;
  run.signals[Signal::i_a] = meter;
  const Model model = with_noise(servo_model());
  expect_truth(calibrate(prepared({run}, model), model).model, 0.01);
}

TEST(Calibrate, UsesAllRuns) {
  const Model model = with_noise(servo_model());
  const emtb::Run one = record({}, {{0.2, 0}, {0.5, 2}}, 1e-3, quiet, 1),
                  other = record({}, {{0.1, 0}, {0.5, -4}}, 1e-3, quiet, 2);
  const Calibration both = calibrate(prepared({one, other}, model), model);
  const Calibration alone = calibrate(prepared({one}, model), model);
  expect_truth(both.model, 0.01);
  EXPECT_LT(*both.model.at(4).std_error, *alone.model.at(4).std_error);
}

TEST(Calibrate, FitsAnEffectOfTheCatalogue) {
  Model model = with_noise(servo_model());
  model.include(effect_index("load_torque"));
  const Calibration c = calibrate(prepared({record({}, synthetic::steps, 1e-3, quiet)}, model), model);
  EXPECT_NEAR(c.model.at(5).value, 0, 4 * *c.model.at(5).std_error) << "which is not there";
}

TEST(Calibrate, RespectsBoundsAndReportsThem) {
  Model model = with_noise(servo_model());
  model.at(1).max = 0.041;  // the truth is 0.042
  const Calibration c = calibrate(prepared({record({}, synthetic::steps, 1e-3, quiet)}, model), model);
  EXPECT_EQ(c.model.at(1).value, 0.041);
  EXPECT_THAT(c.at_bound, ElementsAre("K_b"));
  EXPECT_FALSE(c.model.at(1).std_error);
  EXPECT_TRUE(c.converged);
  EXPECT_LT(c.iterations, 30) << "the others must not creep beside it";
}

TEST(Calibrate, WhatGoesWithAParameterOnItsBoundIsNoBetterKnownThanThatAllows) {
  // By a noisy current, B and K_b are told from each other by little; B comes to rest at nothing in half of the cases.
  const Model model = servo_model();
  int beyond = 0, at_bound = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    const auto records =
        prepared({record({.B = 1e-6}, synthetic::steps, 1e-3, {.omega = 0.5, .i_a = 0.5}, seed)}, model);
    const Calibration c = calibrate(records, model);
    if (c.at_bound != std::vector<std::string>{"B"}) continue;
    ++at_bound;
    if (std::abs(c.model.at(1).value - Truth{}.K_b) > 2.5 * c.model.at(1).std_error.value()) ++beyond;
  }
  EXPECT_GE(at_bound, 3);
  EXPECT_EQ(beyond, 0);
}

TEST(Calibrate, AnEffectThatIsAbsentRestsOnItsNull) {
  Model model = with_noise(servo_model());
  model.include(effect_index("coulomb_friction"));
  model.include(effect_index("windage"));
  const emtb::Run run = record({}, synthetic::steps, 1e-3, quiet, 5);
  const Calibration c = calibrate(prepared({run}, model), model);
  for (const std::size_t place : {5U, 6U}) {
    EXPECT_GE(c.model.at(place).value, 0);
    if (c.model.at(place).std_error) {
      EXPECT_LT(c.model.at(place).value, 4 * *c.model.at(place).std_error);
    }
  }
  const Calibration base = calibrate(prepared({run}, with_noise(servo_model())), with_noise(servo_model()));
  EXPECT_LE(c.cost, base.cost * (1 + 1e-9));
  EXPECT_LT(c.iterations, 30);
}

TEST(Calibrate, APriorDecidesWhatTheDataLeaveOpen) {
  Model model = with_noise(servo_model());
  model.at(0).prior = Prior{1.2, 0.01};  // an ohmmeter
  model.at(3).value = Truth{}.B;
  model.at(3).fixed = true;
  const Calibration c = calibrate(prepared({speed_only(record({}, synthetic::steps, 1e-3, quiet))}, model), model);
  EXPECT_NEAR(c.model.at(0).value, 1.2, 0.001);
  EXPECT_NEAR(*c.model.at(0).std_error, 0.01, 0.001);
  EXPECT_NEAR(c.model.at(1).value, 0.042, 0.0005);
}

TEST(Calibrate, APriorPullsAgainstTheDataByItsWeight) {
  Model model = with_noise(servo_model());
  const auto records = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  const Calibration free = calibrate(records, model);
  const double found = free.model.at(0).value, error = *free.model.at(0).std_error;
  model.at(0).prior = Prior{found + 10 * error, 1e-3 * error};
  EXPECT_NEAR(calibrate(records, model).model.at(0).value, found + 10 * error, 0.01 * error);
  model.at(0).prior = Prior{found + 10 * error, 1e3 * error};
  EXPECT_NEAR(calibrate(records, model).model.at(0).value, found, 0.01 * error);
}

TEST(Calibrate, WhatOnlyTheSupplyTellsIsKnownAsFarAsThatIs) {
  Model model = with_noise(servo_model());
  model.tie.clear();  // so that no torque tells the size of the current
  model.include(effect_index("supply_current"));
  emtb::Run run = record({}, synthetic::steps, 1e-3, quiet);
  constexpr double supply = 26;
  for (std::size_t k = 0; k < run.at(Signal::i_a).value.size(); ++k)
    run.signals[Signal::i_a].value.edit()[k] *= std::abs(run.at(Signal::e_a).value[k]) / supply;
  const Calibration c = calibrate(prepared({run}, model), model);
  const Parameter& V_s = c.model.parameters_of(effect_index("supply_current"))[0];
  EXPECT_NEAR(V_s.value, 24, 1) << "the driver's limit";
  ASSERT_TRUE(V_s.std_error);
  EXPECT_NEAR(*V_s.std_error, 0.2 * 24, 1);
  const double R_a_error = c.model.at(base::R_a).std_error.value_or(0);
  EXPECT_NEAR(R_a_error, 0.2 * c.model.at(base::R_a).value, 0.05) << "which carries all that goes with it";
  EXPECT_NEAR(c.model.at(base::R_a).value * V_s.value / supply, Truth{}.R_a, 0.03);
}

TEST(Calibrate, LeavesFixedParametersAlone) {
  Model model = with_noise(servo_model());
  model.at(0).value = 1.2;
  model.at(0).fixed = true;
  const auto records = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  const Calibration c = calibrate(records, model);
  EXPECT_EQ(c.model.at(0).value, 1.2);
  EXPECT_FALSE(c.model.at(0).std_error);
  expect_truth(c.model, 0.005);
  for (std::size_t i = 0; i < 5; ++i) model.at(i).fixed = true;
  EXPECT_GT(calibrate(records, model).cost, 0) << "nothing to fit: the cost as it stands";
}

TEST(Calibrate, SeveralStartsEscapeABadOne) {
  const emtb::Run run = record({}, synthetic::steps, 1e-3, quiet);
  const Model good = with_noise(servo_model());
  const double lowest = calibrate(prepared({run}, good), good).cost;
  for (const auto& bad : {std::vector{6.0, 0.3, 0.3, 1e-3, 1e-3}, std::vector{0.2, 0.005, 0.005, 0.0, 5e-6},
                          std::vector{6.0, 0.005, 0.005, 1e-3, 1e-3}, std::vector{0.2, 0.3, 0.3, 0.0, 1e-3}}) {
    Model model = good;
    auto records = prepared({run}, good);  // weights of the good model: the costs compare
    for (std::size_t i = 0; i < 5; ++i) model.at(i).value = bad[i];
    const Calibration c = calibrate(records, model);
    EXPECT_NEAR(c.cost, lowest, 1e-6 * lowest) << "from R_a = " << bad[0] << ", K_b = " << bad[1];
    expect_truth(c.model, 0.005);
  }
}

TEST(Calibrate, EndsAtTheSameOnOneCoreAsOnAll) {
  const Model model = with_noise(servo_model());
  const std::vector<Record> one_run = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  const Calibration shared_out = calibrate(one_run, model);
  const OneThreadHere alone;
  const Calibration by_itself = calibrate(one_run, model);
  EXPECT_EQ(shared_out.model.values(), by_itself.model.values());
  EXPECT_EQ(shared_out.cost, by_itself.cost);
}

TEST(Calibrate, NinetyFivePercentIntervalsHoldTheTruthThatOften) {
  // A recording of the model's own, so that nothing but the noise is wrong. 30 s at 100 Hz.
  Model truth = with_noise(servo_model());
  for (const auto& [place, value] : {std::pair(0U, 1.2), {1U, 0.042}, {3U, 1.2e-5}, {4U, 6e-5}})
    truth.at(place).value = value;
  std::vector<synthetic::Hold> plan;
  for (int n = 0; n < 60; ++n) plan.push_back({0.5, 2 + 1.5 * std::sin(2.4 * n)});
  const emtb::Run clean = record({}, plan, 1e-2);
  std::vector<Record> records{{observe_run(speed_only(clean), truth)}};
  Record& run = records[0];
  Observation i_a = run.observations[0];
  i_a.signal = Signal::i_a;
  run.observations.push_back(i_a);
  run.excitation.longest_step = 2.5e-3;  // errs by far less than the noise, as the fit would notice
  run.excitation.initial = {};
  Trajectory<double> y;
  simulate<double>(run.structure(truth), truth.values(), run.excitation, y);
  for (Observation& o : run.observations) o.sigma.assign(o.size(), o.signal == Signal::omega ? 0.5 : 0.05);

  CalibrationOptions one_start;
  one_start.extra_starts = 0;
  std::map<std::size_t, int> inside;
  constexpr unsigned seeds = 200;
  for (unsigned seed = 0; seed < seeds; ++seed) {
    synthetic::Noise noise(seed);
    for (Observation& o : run.observations) {
      const std::vector<double>& signal = o.signal == Signal::omega ? y.omega : y.i_a;
      for (std::size_t k = 0; k < o.size(); ++k) o.value.edit()[k] = signal[o.last[k]] + noise(o.sigma[k]);
    }
    const Calibration c = calibrate(records, truth, one_start);
    for (const std::size_t place : {0U, 1U, 3U, 4U}) {
      const Parameter& p = c.model.at(place);
      ASSERT_TRUE(p.std_error) << p.symbol;
      inside[place] += std::abs(p.value - truth.at(place).value) < 1.96 * *p.std_error;
    }
  }
  ASSERT_EQ(inside.size(), 4U);
  for (const auto& [place, count] : inside) {
    EXPECT_GE(count, 0.90 * seeds) << truth.at(place).symbol;
    EXPECT_LE(count, 0.99 * seeds) << truth.at(place).symbol;
  }
}

TEST(Calibrate, ErrorsHoldWhatTheLengthOfTheStepsDoes) {
  // The truth in steps of 1 ms, the model in steps of 10 ms: the noise is not what is wrong.
  Model truth = with_noise(servo_model());
  std::vector<synthetic::Hold> plan;
  for (int n = 0; n < 60; ++n) plan.push_back({0.5, 2 + 1.5 * std::sin(2.4 * n)});
  std::vector<Record> records{{observe_run(speed_only(record({}, plan, 1e-2)), truth)}};
  Record& run = records[0];
  run.excitation.initial = {};
  run.excitation.longest_step = 1e-3;
  Trajectory<double> y;
  simulate<double>(run.structure(truth), truth.values(), run.excitation, y);
  for (Observation& o : run.observations) {
    o.sigma.assign(o.size(), 0.01);
    for (std::size_t k = 0; k < o.size(); ++k) o.value.edit()[k] = y.omega[o.last[k]];
  }
  truth.at(0).fixed = true;  // the speed alone does not tell it
  run.excitation.longest_step = 1e-2;
  const Calibration coarse = calibrate(records, truth);
  const Parameter& J = coarse.model.at(4);
  ASSERT_TRUE(J.std_error);
  EXPECT_GT(std::abs(J.value - truth.at(4).value), 3 * coarse.alone[coarse.alone.size() - 1]) << "more than noise does";
  EXPECT_LT(std::abs(J.value - truth.at(4).value), 1.96 * *J.std_error);
}

TEST(Calibrate, ErrorsGrowWhereResidualsAreCorrelated) {
  Model model = with_noise(servo_model());
  model.at(0).fixed = model.at(3).fixed = true;
  model.at(0).value = Truth{}.R_a;
  model.at(3).value = Truth{}.B;
  const auto error_of_K_b = [&](double rho) {
    emtb::Run run = speed_only(record({}, {{0.2, 0}, {10, 2}, {10, -3}}, 1e-3));
    const std::vector<double> noise = synthetic::coloured(run.at(Signal::omega).t.size(), rho, 11);
    for (std::size_t k = 0; k < noise.size(); ++k) run.signals[Signal::omega].value.edit()[k] += 0.1 * noise[k];
    return *calibrate(prepared({run}, model), model).model.at(1).std_error;
  };
  // A mean of n readings with correlation rho from one to the next is worth n (1 - rho)/(1 + rho) of them.
  EXPECT_NEAR(error_of_K_b(0.95) / error_of_K_b(0), std::sqrt(1.95 / 0.05), 2);
}

/// In how many of 40 recordings of 20 s the 95 % interval of B holds the truth.
template <class Spoil>
int covered(const Spoil& spoil) {
  const Model model = with_noise(servo_model());
  int count = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    emtb::Run run = record({}, synthetic::steps, 2e-3, quiet, seed);
    spoil(run, seed);
    const Parameter B = calibrate(prepared({run}, model), model).model.at(3);
    count += B.std_error && std::abs(B.value - Truth{}.B) < 1.96 * *B.std_error ? 1 : 0;
  }
  return count;
}

TEST(Calibrate, ErrorsHoldWhereResidualsRememberForAGoodPartOfTheRecording) {
  const auto slow_current = [](emtb::Run& run, unsigned seed) {
    const std::span<double> i_a = run.signals[Signal::i_a].value.edit();
    const std::vector<double> slow = synthetic::coloured(i_a.size(), 0.998, seed);
    for (std::size_t k = 0; k < i_a.size(); ++k) i_a[k] += 0.03 * slow[k];
  };
  EXPECT_GE(covered(slow_current), 34);
}

TEST(Calibrate, ErrorsHoldThatARoundedReadingIsOffByTheSameForAsLongAsItStands) {
  const Model model = with_noise(servo_model());
  std::vector<Record> records = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  const Parameter noisy = calibrate(records, model).model.at(3);
  for (Observation& o : records.front().observations) {
    for (std::size_t k = 0; k + 100 <= o.size(); k += 100) o.rounded.push_back({k, k + 100, o.value[k]});
  }
  EXPECT_NEAR(*calibrate(records, model).model.at(3).std_error / *noisy.std_error, std::sqrt(100), 3);
}

TEST(Calibrate, NamesWhatTheSpeedAloneCannotDetermine) {
  Model model = with_noise(servo_model());
  model.tie.clear();
  const Calibration c = calibrate(prepared({speed_only(record({}, synthetic::steps, 1e-3, quiet))}, model), model);
  // Gain and time constant: two of five. The gain is 1/K_b but for the friction; of R_a, K_m, J and B it says next to
  // nothing.
  ASSERT_EQ(c.identifiability.singular_values.size(), 5);
  ASSERT_EQ(c.identifiability.undetermined.size(), 3U);
  std::string words;
  for (const Undetermined& u : c.identifiability.undetermined) {
    words += u.combination + "; ";
    EXPECT_GT(u.relative_error, 0.3);
  }
  for (const char* symbol : {"R_a", "K_m", "J", "B"}) EXPECT_THAT(words, HasSubstr(symbol));
  EXPECT_THAT(words, Not(HasSubstr("K_b")));
}

TEST(Calibrate, ComparesWithTheWantedOutputsAlone) {
  const Model model = with_noise(servo_model());
  const auto records = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  CalibrationOptions omega_only;
  omega_only.outputs = {Signal::omega};
  const Calibration all = calibrate(records, model), speed = calibrate(records, model, omega_only);
  EXPECT_LT(speed.cost, 0.6 * all.cost);
}

TEST(Calibrate, BeginsElsewhereWhereNoMachineHasTheValuesGiven) {
  Model model = with_noise(servo_model());
  const auto records = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  const std::size_t soft = effect_index("shaft_compliance");
  model.include(soft);
  model.parameters_of(soft)[0].value = 10;                             // [N m/rad]
  model.parameters_of(soft)[2].value = 1.1 * model.at(base::J).value;  // a part of J, larger than it
  model.parameters_of(soft)[2].max = 2 * model.at(base::J).value;
  EXPECT_TRUE(std::isfinite(calibrate(records, model).cost));
}

TEST(Calibrate, RefusesAModelThatCannotBeSimulated) {
  Model model = with_noise(servo_model());
  const auto records = prepared({record({}, synthetic::steps, 1e-3, quiet)}, model);
  model.at(4).value = std::numeric_limits<double>::quiet_NaN();
  try {
    calibrate(records, model);
    FAIL() << "accepted";
  } catch (const ModelError& e) {
    EXPECT_THAT(e.what(), HasSubstr("`servo` cannot be simulated with its start values"));
  }
}

}  // namespace
}  // namespace emtb
