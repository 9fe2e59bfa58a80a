#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "analysis/diagnose/hypotheses.h"
#include "analysis/diagnose/null_fit.h"
#include "analysis/record/dataset.h"
#include "tests/analysis/diagnose/answers.h"
#include "tests/analysis/synthetic.h"

namespace emtb::waves_tests {
namespace {

/// Runs in which the shaft creeps to and fro by less than a turn, so that no spectrum shows what repeats with its
/// angle.
emtb::Run creeping(double ripple, unsigned seed) {
  constexpr double row = 0.0125, level = 0.03, phase = 0.7;
  std::vector<synthetic::Hold> plan{{0.1, 0}};
  for (unsigned n = 0; n < 10; ++n) plan.push_back({0.2, level * std::sin(2.4 * (seed + n))});
  emtb::Run run = synthetic::record({.J = 4e-4}, plan, row);
  run.signals.erase(Signal::e_a);
  run.signals.erase(Signal::i_a);
  synthetic::Noise noise(seed);
  Series& omega = run.signals[Signal::omega];
  double angle = 0, before = 0;
  for (double& value : omega.value.edit()) {
    angle += 0.5 * row * (before + value);
    before = value;
    value = value * (1 + ripple * std::sin(6 * angle + phase)) + noise(0.002);
  }
  return run;
}

Diagnosis diagnosed(double ripple) {
  Model model = synthetic::servo_model();
  model.at(base::R_a).value = synthetic::Truth{}.R_a;
  model.at(base::R_a).fixed = true;
  std::vector<emtb::Run> train, held_out;
  for (unsigned n = 1; n <= 4; ++n) train.push_back(creeping(ripple, n));
  for (unsigned n = 5; n <= 6; ++n) held_out.push_back(creeping(ripple, n));
  return diagnose(train, held_out, model);
}

TEST(WaveOfATachogenerator, IsFoundInRunsOfLessThanATurn) {
  const Diagnosis d = diagnosed(0.1);
  EXPECT_THAT(answers::named(d), testing::ElementsAre("tacho_ripple")) << answers::report(d);
  EXPECT_NEAR(answers::fitted(d, "r"), 0.1, 0.01);
  EXPECT_NEAR(answers::fitted(d, "N"), 6, 0.5) << "in less than a turn";
}

TEST(WaveOfATachogenerator, MayComeOnceATurnWhereACoggingDoesNot) {
  const Model model = synthetic::servo_model();
  const std::vector<emtb::Run> runs{creeping(0, 1)};
  const std::array candidates{effect_index("cogging"), effect_index("tacho_ripple")};
  const std::vector<Hypothesis> tried =
      hypotheses_of(null_fit(prepare(runs, {}, model).train, model), candidates, true);
  for (const std::size_t effect : candidates) {
    const bool once =
        std::ranges::any_of(tried, [&](const Hypothesis& h) { return h.effect == effect && h.at[1] == 1; });
    EXPECT_EQ(once, effect == candidates[1]) << "a torque that comes once a turn is an eccentric load";
  }
}

TEST(WaveOfATachogenerator, IsNotFoundWhereThereIsNone) {
  const Diagnosis d = diagnosed(0);
  EXPECT_THAT(d.missing, testing::IsEmpty()) << answers::report(d);
}

}  // namespace
}  // namespace emtb::waves_tests
