#include "analysis/diagnose/remainder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "analysis/diagnose/criterion.h"
#include "model/catalogue.h"
#include "tests/analysis/synthetic.h"

namespace emtb {
namespace {

/// What a search tells of an effect that leaves so many floors. @param why it was refused; empty: it was not
Candidate leaving(double floors, const std::string& effect, const std::string& why) {
  Candidate c;
  c.score.effect = effect_index(effect);
  c.held_out_error = floors;
  c.implausible = why;
  return c;
}

TEST(Remainder, IsALawWhereARefusedEffectTakesMostOfIt) {
  const std::vector<Candidate> refused{leaving(1.1, "field_heating", "tau is 6.5 s, not above 10 s")};
  EXPECT_TRUE(is_of_a_refused_law(refused, 48));
  EXPECT_FALSE(is_of_a_refused_law(refused, 1.5)) << "a fifth of it stays";
}

TEST(Remainder, IsNoneWhereNoRefusedEffectHelpsOrOneThatLoggingLooksLike) {
  EXPECT_FALSE(is_of_a_refused_law({}, 48));
  EXPECT_FALSE(is_of_a_refused_law(std::vector{leaving(40, "field_heating", "tau is 6.5 s")}, 48));
  EXPECT_FALSE(is_of_a_refused_law(std::vector{leaving(1.1, "driver_delay", "within a row")}, 48));
  EXPECT_FALSE(is_of_a_refused_law(std::vector{leaving(1.1, "field_heating", "")}, 48)) << "not refused";
}

/// Readings of a speed and a torque that a model leaves, each as many floors off throughout.
Loss left(double speed, double torque) {
  constexpr int n = 5000;
  Record run;
  std::vector<Residuals> residuals;
  for (const auto& [signal, floors] : {std::pair{Signal::omega, speed}, std::pair{Signal::torque, torque}}) {
    if (floors == 0) continue;
    Observation o;
    o.signal = signal;
    for (std::uint32_t k = 0; k < n; ++k) {
      o.first.push_back(k);
      o.last.push_back(k);
      o.value.push_back(k % 100 < 50 ? 10 : -10);
      o.sigma.push_back(1);
    }
    run.observations.push_back(o);
    residuals.push_back({0, signal, Eigen::VectorXd::Constant(n, floors), {}});
  }
  for (int k = 0; k < n; ++k) run.excitation.t.push_back(1e-3 * k);
  Loss loss({{Signal::omega, {.sigma = 1}}, {Signal::torque, {.sigma = 1}}});
  loss.add(std::vector{run}, residuals);
  return loss;
}

/// Five floors, a quarter of what a speed does, of an instrument whose noise may be coloured, or is known.
Loss lasting(const Dataset& data, double seconds, bool may_be_coloured = true) {
  const Observation& o = *data.train[0].find(Signal::omega);
  const auto n = static_cast<Eigen::Index>(o.size());
  Loss loss({{Signal::omega, {.sigma = 1, .lower_bound = may_be_coloured}}});
  loss.add(data.train, std::vector<Residuals>{{0, Signal::omega, Eigen::VectorXd::Constant(n, 5), {}}});
  loss.quality.emplace().memory = {{Signal::omega, seconds}};
  return loss;
}

TEST(Remainder, IsNoNoiseWhereItIsALargePartOfTheSignalForLongerThanNoiseLasts) {
  const Model servo = synthetic::servo_model();
  emtb::Run run = synthetic::record({}, {{1, 0.25}, {1, -0.25}}, 1e-2, {.omega = 0.1});
  Dataset data = prepare(std::vector{run}, {}, servo);
  for (Observation& o : data.train[0].observations) {
    if (o.signal != Signal::omega) continue;
    o.sigma.assign(o.size(), 1);
  }
  EXPECT_FALSE(worth_a_name(data, servo, lasting(data, 0.1), {}, {})) << "ten readings";
  EXPECT_TRUE(worth_a_name(data, servo, lasting(data, 0.5), {}, {})) << "fifty";
}

TEST(Remainder, IsNoiseWhereItIsAnotherInEachReading) {
  const Model servo = synthetic::servo_model();
  Dataset data = prepare(std::vector{synthetic::record({}, {{1, 0.25}, {1, -0.25}}, 1e-2, {.omega = 0.1})}, {}, servo);
  std::mt19937 random(1);
  std::normal_distribution<double> hops(0, 5);
  for (const Residuals& r : residuals(data.train, servo, servo.values(), {})) {
    if (r.signal != Signal::omega) continue;
    Observation& o = *std::ranges::find(data.train[0].observations, Signal::omega, &Observation::signal);
    const std::span<double> values = o.value.edit();
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] += hops(random) - r.value(static_cast<Eigen::Index>(i)) * o.sigma[i];
    o.sigma.assign(o.size(), 1);
  }
  EXPECT_FALSE(worth_a_name(data, servo, lasting(data, 0.002, false), {}, {}));
  EXPECT_TRUE(worth_a_name(data, servo, lasting(data, 0.1, false), {}, {})) << "it lasts, and the instrument is known";
}

TEST(MaterialityCriterion, AsksNoMoreOfATorqueThatOnlyLoads) {
  const MaterialityCriterion of_all({}), of_the_motion({}, true);
  const Loss explained = left(1, 5), lacking = left(5, 1), alone = left(0, 5);
  for (const auto asked : {&Criterion::remainder, &Criterion::worth_a_wide_search, &Criterion::far_off,
                           &Criterion::worth_trying_all, &Criterion::anything_left}) {
    EXPECT_TRUE((of_all.*asked)(explained));
    EXPECT_FALSE((of_the_motion.*asked)(explained));
    EXPECT_TRUE((of_the_motion.*asked)(lacking)) << "something is left of the motion";
    EXPECT_TRUE((of_the_motion.*asked)(alone)) << "a law of the torque is asked of its reading";
  }
  EXPECT_TRUE(of_the_motion.material(explained, left(1, 1))) << "what is better is";
}

}  // namespace
}  // namespace emtb
