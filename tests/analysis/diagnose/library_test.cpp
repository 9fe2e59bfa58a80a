// Effects that a simulated bench hides one at a time, beside what they need.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/analysis/diagnose/answers.h"
#include "tests/blind/recording.h"

namespace emtb {
namespace {

using namespace answers;
using testing::ElementsAre;
using testing::UnorderedElementsAre;

TEST(DiagnoseLibrary, NamesADryBrakeBehindTheGauge) {
  for (const bool fast : {false, true}) {
    blind::Bench bench = fast ? blind::fast_bench() : blind::slow_bench();
    const double T_b = fast ? 0.01 : 0.08;  // [N m]
    bench.plant.load.brake = T_b;
    const Diagnosis d = diagnose_on(bench);
    EXPECT_EQ(d.verdict, Verdict::found) << report(d);
    EXPECT_THAT(named(d), ElementsAre("dry_brake")) << report(d);
    EXPECT_NEAR(fitted(d, "T_b"), T_b, 0.02 * T_b);
    EXPECT_LE(d.final_held_out, 1.1);
  }
}

TEST(DiagnoseLibrary, NamesADryBrakeBesideTheMotorsOwnFriction) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction.T_c = 0.003;
  bench.plant.load.brake = 0.01;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("coulomb_friction", "dry_brake")) << report(d);
  EXPECT_NEAR(fitted(d, "T_c"), 0.003, 2e-4);
  EXPECT_NEAR(fitted(d, "T_b"), 0.01, 2e-4);
}

TEST(DiagnoseLibrary, NamesASpringAtTheLoad) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.spring = 0.03;  // [N m/rad] five turns at most
  bench.plant.load.spring_torque = 0.02;
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::torque; });
  const Diagnosis d = diagnose_on(bench);
  EXPECT_EQ(d.verdict, Verdict::found) << report(d);
  EXPECT_THAT(named(d), ElementsAre("spring_load")) << report(d);
  EXPECT_NEAR(fitted(d, "k"), 0.03, 3e-4);
  EXPECT_NEAR(fitted(d, "T_0"), 0.02, 1e-3);
}

TEST(DiagnoseLibrary, CallsABrakeThatNoGaugeSeesFriction) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.load.brake = 0.006;
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::torque; });
  const Diagnosis d = diagnose_on(bench);
  EXPECT_EQ(d.verdict, Verdict::found) << report(d);
  EXPECT_THAT(named(d), ElementsAre("coulomb_friction")) << "without a gauge they are the same: " << report(d);
}

TEST(DiagnoseLibrary, NamesFrictionThatGrowsWithTheLoadOfTheGears) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction = {.T_c = 0.003, .gears = 0.15};
  bench.plant.load.torque = 0.015;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("coulomb_friction", "load_torque", "load_dependent_friction"))
      << report(d);
  EXPECT_NEAR(fitted(d, "k_l"), 0.15, 0.02);
}

TEST(DiagnoseLibrary, NamesTheDragOfABearing) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.motor.bearing_drag = 8e-5;  // [N m (s/rad)^(2/3)] 0.005 N m at 500 rad/s
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("bearing_drag")) << report(d);
  EXPECT_NEAR(fitted(d, "c_b"), 8e-5, 4e-6);
}

TEST(DiagnoseLibrary, NamesASpeedThatIsReadLate) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.sensors.delay = 0.008;
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("speed_delay")) << report(d);
  EXPECT_NEAR(fitted(d, "t_d"), 0.008, 4e-4);
}

TEST(DiagnoseLibrary, NamesAnAngleThatIsReadLate) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.sensors.delay = 0.03;
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::omega; });
  bench.channels.push_back({.signal = Signal::theta, .low = -8000, .high = 8000, .bits = 24});  // 1 mrad
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), testing::Contains("speed_delay")) << report(d);
  EXPECT_NEAR(fitted(d, "t_d"), 0.03, 2e-3);
}

TEST(DiagnoseLibrary, NamesFrictionThatGivesBeforeItSlips) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction = {.T_c = 0.005, .deflection = 0.05};
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::omega; });
  bench.channels.push_back({.signal = Signal::theta, .low = -8000, .high = 8000, .bits = 24});  // 1 mrad
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("coulomb_friction", "presliding_friction")) << report(d);
  EXPECT_NEAR(fitted(d, "sigma_0"), 0.1, 0.03);
}

TEST(DiagnoseLibrary, NamesABridgeThatTakesNoCurrentBackEitherWay) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.one_quadrant = true;
  bench.plant.driver.rise = bench.plant.driver.fall = simulated::unlimited;
  bench.model.driver->rise = bench.model.driver->fall = DriverModel::unlimited;
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::e_a; });
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("one_quadrant_driver")) << report(d);
}

TEST(DiagnoseLibrary, NamesABridgeThatLetsGoAtZero) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.driver.coasts = true;
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::e_a; });
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), ElementsAre("coasting_driver")) << report(d);
}

TEST(DiagnoseLibrary, NamesABridgeWhoseCurrentHasGaps) {
  blind::Bench bench = blind::fast_bench();
  bench.plant.friction.T_c = 0.006;
  bench.plant.driver.chop_period = 1.5;
  bench.plant.driver.chop_supply = 26;
  std::erase_if(bench.channels, [](const auto& c) { return c.signal == Signal::e_a; });
  const Diagnosis d = diagnose_on(bench);
  EXPECT_THAT(named(d), UnorderedElementsAre("coulomb_friction", "pwm_drive")) << report(d);
  EXPECT_NEAR(fitted(d, "r"), 1.5, 0.1);
  EXPECT_NEAR(fitted(d, "V_s"), 26, 0.3);
}

}  // namespace
}  // namespace emtb
