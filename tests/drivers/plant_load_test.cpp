// What hangs at the simulated motor's shaft, its bearings, and readings that come over a bus.
#include <gtest/gtest.h>

#include <cmath>
#include <utility>
#include <vector>

#include "drivers/simulated/plant.h"
#include "tests/drivers/servo.h"

namespace emtb::simulated {
namespace {

TEST(Plant, ADryBrakeTakesItsTorqueWhateverTheSpeedAndTheGaugeSeesIt) {
  for (const FrictionLaw law : {FrictionLaw::bristle, FrictionLaw::hard}) {
    for (const double reference : {-5.0, 1.0, 5.0}) {
      PlantParameters p = servo();
      p.friction = {.law = law, .T_c = 0.002};
      p.load.brake = 0.006;
      Plant plant(p);
      run(plant, 3, reference);
      const double direction = reference > 0 ? 1 : -1;
      EXPECT_NEAR(plant.gauge(), 0.006 * direction, 1e-9);
      EXPECT_NEAR(0.042 * plant.i_a(), 0.008 * direction + 1e-5 * plant.omega(), 1e-6);
    }
  }
}

TEST(Plant, ADryBrakeHoldsAndDoesNotPush) {
  PlantParameters p = servo();
  p.load.brake = 0.006;
  Plant plant(p);
  const double slips = 1.2 * 0.006 / 0.042 / 4;  // [V] of the reference
  run(plant, 2, 0.95 * slips);
  EXPECT_NEAR(plant.omega(), 0, 1e-6);
  EXPECT_NEAR(plant.gauge(), 0.95 * 0.006, 1e-6);
  run(plant, 2, 0);
  EXPECT_NEAR(plant.gauge(), 0, 1e-6);
  EXPECT_NEAR(plant.omega(), 0, 1e-6);
  run(plant, 2, 1.05 * slips);
  EXPECT_GT(plant.omega(), 0.1);
}

TEST(Plant, ADryBrakeSitsBehindACompliantShaft) {
  PlantParameters p = servo();
  p.shaft = {.stiffness = 0.5, .damping = 1e-3, .J_2 = 2e-5};
  p.load.brake = 0.006;
  Plant plant(p);
  run(plant, 3, 4);
  EXPECT_NEAR(0.042 * plant.i_a(), 0.006 + 1e-5 * plant.omega(), 1e-6);
  EXPECT_NEAR(plant.gauge(), 0.006, 1e-9);
}

TEST(Plant, ALoadThatFrictionHoldsAtRestHasBentTheShaft) {
  PlantParameters p = servo();
  p.friction = {.law = FrictionLaw::hard, .T_c = 0.012};
  p.shaft = {.stiffness = 0.5, .damping = 1e-3, .J_2 = 2e-5, .gap = 0.1};
  p.load.torque = 0.01;  // twice that, as it would swing from a shaft that is straight, would turn the motor
  Plant plant(p);
  run(plant, 1, 0);
  EXPECT_EQ(plant.omega(), 0);
  EXPECT_EQ(plant.theta(), 0);
}

TEST(Plant, AnEccentricLoadIsSeenByTheGauge) {
  PlantParameters p = servo();
  p.load = {.torque = 0.01, .eccentric = 0.004, .eccentric_phase = 0.3};
  Plant plant(p);
  for (int n = 0; n < 300; ++n) {
    plant.advance(tick, 1);
    ASSERT_NEAR(plant.gauge(), 0.01 + 0.004 * std::sin(plant.theta() + 0.3), 1e-12);
  }
}

TEST(Plant, ASpringHoldsTheShaftWhereItPullsAsTheMotorDoes) {
  PlantParameters p = servo();
  p.load = {.spring = 0.02, .spring_torque = 0.005};
  Plant plant(p);
  run(plant, 3, 1);
  EXPECT_NEAR(plant.omega(), 0, 1e-6);
  EXPECT_NEAR(plant.gauge(), 0.042 * plant.i_a(), 1e-6);
  EXPECT_NEAR(plant.gauge(), 0.005 + 0.02 * plant.theta(), 1e-9);
}

TEST(Plant, TheEddyBrakesSpeedRisesAsItsDiscGetsHot) {
  PlantParameters p = servo();
  p.load = {.eddy_torque = 0.03, .eddy_omega = 200, .eddy_heating = 1e-3};
  Plant plant(p);
  run(plant, 20, 5);
  const double omega = plant.omega(), torque = plant.load_torque();
  const double heat = torque * omega * 60 * (1 - std::exp(-20.0 / 60));  // [J] the torque hardly changed
  const double x = omega / (200 * (1 + 1e-3 * heat));
  EXPECT_GT(heat, 100);
  EXPECT_NEAR(torque, 0.06 * x / (1 + x * x), 0.005 * torque);
}

TEST(Plant, BearingDragGrowsWithTheSpeedToTheTwoThirds) {
  PlantParameters p = servo();
  p.motor.bearing_drag = 4e-5;
  for (const double reference : {-6.0, 1.0, 6.0}) {
    Plant plant(p);
    run(plant, 3, reference);
    const double w = plant.omega();
    EXPECT_NEAR(0.042 * plant.i_a(), 1e-5 * w + std::copysign(4e-5 * std::cbrt(w * w), w), 1e-9);
  }
}

TEST(Plant, ABusBringsSpeedAndAngleLateAndNothingElse) {
  PlantParameters p = servo();
  p.sensors.ripple = 0.02;
  Plant now(p);
  p.sensors.delay = 0.0123;
  Plant late(p);
  std::vector<double> tacho, theta;
  for (int n = 0; n < 300; ++n) {
    now.advance(1e-4, n < 150 ? 3 : 1);
    late.advance(1e-4, n < 150 ? 3 : 1);
    tacho.push_back(now.tacho());
    theta.push_back(now.encoder());
    EXPECT_EQ(late.omega(), now.omega());
    EXPECT_EQ(late.i_a(), now.i_a());
    ASSERT_TRUE(n >= 122 || late.tacho() == 0) << "nothing has come yet";
    if (n < 124) continue;
    const auto then = static_cast<std::size_t>(n - 123);
    ASSERT_NEAR(late.tacho(), tacho[then], 1e-6) << n;
    ASSERT_NEAR(late.encoder(), theta[then], 1e-8) << n;
  }
}

TEST(Plant, TheSupplyOfABridgeGivesTheMotorsCurrentForAsLongAsItIsOn) {
  PlantParameters p = servo();
  Plant motor(p);
  p.sensors.supply = 24;
  Plant supply(p);
  double charge = 0;
  for (int n = 0; n < 3000; ++n) {
    motor.advance(1e-4, 1.5);
    supply.advance(1e-4, 1.5);
    charge += 1e-4 * 0.25 * motor.i_a();
  }
  EXPECT_EQ(supply.i_a(), motor.i_a());
  EXPECT_EQ(motor.ammeter(), motor.i_a());
  EXPECT_NEAR(supply.ammeter(), 0.25 * motor.i_a(), 1e-12);
  EXPECT_NEAR(supply.charge(), charge, 0.01 * charge);
}

}  // namespace
}  // namespace emtb::simulated
