#include "analysis/diagnose/explained_floor.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/analysis/diagnose/answers.h"
#include "tests/analysis/synthetic.h"

namespace emtb::explained_floor {
namespace {

/// Runs so short that the shaft hardly turns while its speed is settled: what repeats twice a turn passes for noise.
/// @param bias [A] of the current, which is not read without one
emtb::Run brief_run(double ripple, double bias, const std::vector<synthetic::Hold>& plan, unsigned seed) {
  const synthetic::Truth motor{.J = 1e-5};
  emtb::Run run = synthetic::record(motor, plan, 2e-4);
  run.signals.erase(Signal::e_a);
  if (bias == 0) run.signals.erase(Signal::i_a);
  synthetic::Noise noise(seed);
  Series& omega = run.signals[Signal::omega];
  double angle = 0.3 * seed;
  for (std::size_t k = 0; k < omega.t.size(); ++k) {
    if (k > 0) angle += 2e-4 * omega.value[k];
    omega.value.edit()[k] = omega.value[k] * (1 + ripple * std::sin(2 * angle)) + noise(0.5);
    if (bias != 0) run.signals[Signal::i_a].value.edit()[k] += bias + noise(0.005);
  }
  return run;
}

Diagnosis diagnosed(double ripple, double bias = 0) {
  std::vector<emtb::Run> train, held_out;
  for (unsigned n = 1; n <= 4; ++n) {
    const double level = 1.0 + 0.8 * n;
    train.push_back(brief_run(ripple, bias, {{0.03, 0}, {0.12, level}, {0.12, 0.6 * level}}, n));
    held_out.push_back(brief_run(ripple, bias, {{0.03, 0}, {0.12, 0.7 * level}, {0.12, 0.9 * level}}, 10 + n));
  }
  Model model = synthetic::servo_model();
  model.at(base::R_a).value = synthetic::Truth{}.R_a;
  model.at(base::R_a).fixed = true;
  return diagnose(train, held_out, model);
}

TEST(FloorThatAnEffectExplains, IsNoFloor) {
  const Diagnosis d = diagnosed(0.05);
  EXPECT_THAT(answers::named(d), testing::ElementsAre("tacho_ripple")) << answers::report(d);
  EXPECT_NEAR(answers::fitted(d, "r"), 0.05, 0.003);
  EXPECT_NEAR(answers::fitted(d, "N"), 2, 0.01);
}

TEST(FloorThatAnEffectExplains, IsNoneBesideAnotherEffectEither) {
  const Diagnosis d = diagnosed(0.05, 0.1);
  EXPECT_THAT(answers::named(d), testing::UnorderedElementsAre("current_offset", "tacho_ripple")) << answers::report(d);
  EXPECT_NEAR(answers::fitted(d, "r"), 0.05, 0.003);
}

TEST(FloorThatAnEffectExplains, StaysWhereNoEffectExplainsIt) {
  const Diagnosis d = diagnosed(0);
  EXPECT_THAT(d.missing, testing::IsEmpty()) << answers::report(d);
  EXPECT_NEAR(d.data->noise.at(Signal::omega).sigma, 0.5, 0.1);
}

}  // namespace
}  // namespace emtb::explained_floor
