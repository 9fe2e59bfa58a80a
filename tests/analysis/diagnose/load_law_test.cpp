// A torque that a gauge reads: its law, or an input without one.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "model/catalogue.h"
#include "tests/analysis/diagnose/answers.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using namespace answers;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

/// The same run read by an encoder in place of the tachogenerator.
emtb::Run read_by_encoder(emtb::Run run) {
  constexpr double count = 2 * std::numbers::pi / 4000;  // [rad]
  const Series omega = run.at(Signal::omega);
  Series theta = omega;
  double angle = 0;
  for (std::size_t k = 0; k < omega.t.size(); ++k) {
    if (k > 0) angle += 0.5 * (omega.value[k] + omega.value[k - 1]) * (omega.t[k] - omega.t[k - 1]);
    theta.value.edit()[k] = count * std::floor(angle / count);
  }
  theta.lsb = count;
  run.signals.erase(Signal::omega);
  run.signals[Signal::theta] = std::move(theta);
  return run;
}

std::vector<emtb::Run> read_by_encoder(std::vector<emtb::Run> runs) {
  for (emtb::Run& run : runs) run = read_by_encoder(std::move(run));
  return runs;
}

/// The torque of a brake [N m] that nobody leaves alone: another in each run.
std::vector<emtb::Run> with_another_brake_each(blind::Bench bench, const std::vector<Profile>& profiles,
                                               std::uint64_t seed, double least = 0.004, double more = 0.004) {
  std::vector<emtb::Run> runs;
  for (std::size_t i = 0; i < profiles.size(); ++i) {
    bench.plant.load.brake = least + more * static_cast<double>(i % 3);
    runs.push_back(record(bench, profiles[i], seed + i));
  }
  return runs;
}

TEST(LoadLaw, IsToldFromTheSpeedOfAnEncoderToo) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.brake = 0.01;
  const Diagnosis d = diagnose(read_by_encoder(record(bench, bench.train, 1)),
                               read_by_encoder(record(bench, bench.held_out, 101)), bench.model);
  EXPECT_THAT(named(d), ElementsAre("dry_brake")) << report(d);
  EXPECT_NEAR(fitted(d, "T_b"), 0.01, 3e-4);
  EXPECT_FALSE(d.torque_is_input);
}

TEST(LoadLaw, IsAskedBesideWhatTheMotorLacks) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.brake = 0.01;
  bench.plant.motor.brush_drop = 0.8;
  const std::vector<Profile> few(bench.train.begin(), bench.train.begin() + 2);
  const Diagnosis d = diagnose(record(bench, few, 1), record(bench, bench.held_out, 101), bench.model);
  EXPECT_THAT(named(d), UnorderedElementsAre("dry_brake", "brush_drop")) << report(d);
}

TEST(LoadLaw, IsNotToldBesideAMotionThatTheModelLacks) {
  // A brake of the load beside friction that the model as given has wrong: it stands where the machine turns.
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.brake = 0.01;
  bench.plant.friction.T_c = 0.004;
  bench.plant.friction.T_s = 0.02;
  bench.plant.friction.omega_s = 30;
  bench.model.include(effect_index("coulomb_friction"));
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("dry_brake", "stribeck_friction")) << report(d);
}

TEST(LoadLaw, IsLeftOutWhereWhatItIsSeenByReadsWrong) {
  // A law of the speed that was read, which is off: with it the motion stays wrong, which is explained without it.
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.eddy_torque = 0.02;
  bench.plant.load.eddy_omega = 25;
  std::ranges::find(bench.channels, Signal::omega, &simulated::DaqChannel::signal)->offset = -10;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("tacho_offset")) << report(d);
  EXPECT_NEAR(fitted(d, "omega_0"), -10, 0.5);
  EXPECT_TRUE(d.torque_is_input);
}

TEST(LoadLaw, IsThatOfTheShaftsOwnSpeedWhereThisIsReadLate) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.eddy_torque = 0.02;
  bench.plant.load.eddy_omega = 100;
  bench.plant.sensors.delay = 0.02;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("eddy_brake", "speed_delay")) << report(d);
  EXPECT_NEAR(fitted(d, "t_d"), 0.02, 0.001);
  EXPECT_NEAR(fitted(d, "T_b"), 0.02, 0.0005);
  EXPECT_LT(d.signals.at(Signal::torque).ratio, 1.2);
}

TEST(LoadLaw, LeavesNoUnknownEffectWhereItIsNotQuiteTheLoads) {
  const blind::Bench bench = blind::fast_bench();
  const Diagnosis d = diagnose(with_another_brake_each(bench, bench.train, 1, 0.03, 0.006),
                               with_another_brake_each(bench, bench.held_out, 101, 0.03, 0.006), bench.model);
  EXPECT_THAT(named(d), ElementsAre("dry_brake")) << report(d);
  EXPECT_GT(d.signals.at(Signal::torque).ratio, 1.5) << "which the gauge shows";
  EXPECT_EQ(d.verdict, Verdict::found) << report(d);
  EXPECT_TRUE(d.torque_only_loads);
  EXPECT_FALSE(d.torque_is_input);
}

TEST(LoadLaw, NeedNotBe) {
  const blind::Bench bench = blind::fast_bench();
  const std::vector<emtb::Run> train = with_another_brake_each(bench, bench.train, 1),
                               held_out = with_another_brake_each(bench, bench.held_out, 101);
  const Diagnosis d = diagnose(train, held_out, bench.model);
  EXPECT_TRUE(d.torque_is_input);
  EXPECT_EQ(d.verdict, Verdict::nothing_missing) << report(d);
  EXPECT_FALSE(d.signals.contains(Signal::torque)) << "an input is no error of the model";
  EXPECT_LT(d.final_held_out, 1.1);

  DiagnoseOptions asked;
  asked.explain_torque = true;
  const Diagnosis explained = diagnose(train, held_out, bench.model, asked);
  EXPECT_FALSE(explained.torque_is_input);
  EXPECT_EQ(explained.verdict, Verdict::unknown_effect) << report(explained);
}

TEST(LoadLaw, NeedNotBeForTheGaugesOffsetToBeTold) {
  blind::Bench bench = blind::fast_bench();
  std::ranges::find(bench.channels, Signal::torque, &simulated::DaqChannel::signal)->offset = 0.01;
  const Diagnosis d = diagnose(with_another_brake_each(bench, bench.train, 1, 0.01, 0.006),
                               with_another_brake_each(bench, bench.held_out, 101, 0.01, 0.006), bench.model);
  EXPECT_THAT(named(d), ElementsAre("torque_offset")) << report(d);
  EXPECT_NEAR(fitted(d, "T_0"), 0.01, 5e-4);
}

}  // namespace
}  // namespace emtb
