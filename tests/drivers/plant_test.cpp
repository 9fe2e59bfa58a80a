#include "drivers/simulated/plant.h"

#include <gtest/gtest.h>

#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>

#include "hal/error.h"
#include "tests/drivers/servo.h"

namespace emtb::simulated {
namespace {

/// The paper's motor and driver, nothing hidden.
PlantParameters fh2() {
  return {.driver = {.gain = 110.0 / 6, .rise = 22.5, .fall = 20.4, .min = 0, .max = 110},
          .motor = {.R_a = 31.825, .K_b = 0.6739, .K_m = 0.6739, .B = 1e-4, .J = 3.449e-3}};
}

PlantParameters with_friction(PlantParameters p, FrictionLaw law, double T_c, double T_s = 0) {
  p.friction.law = law;
  p.friction.T_c = T_c;
  p.friction.T_s = T_s;
  return p;
}

TEST(Plant, StartsAtRest) {
  Plant plant(servo());
  run(plant, 1, 0);
  EXPECT_EQ(plant.omega(), 0);
  EXPECT_EQ(plant.theta(), 0);
  EXPECT_EQ(plant.i_a(), 0);
  EXPECT_EQ(plant.e_a(), 0);
  EXPECT_NEAR(plant.time(), 1, 1e-9);
}

TEST(Plant, SettlesWhereTheLinearModelDoes) {
  const PlantParameters p = fh2();
  const auto& m = p.motor;
  Plant plant(p);
  run(plant, 20, 6);
  const double omega = m.K_m / m.R_a * 110 / (m.B + m.K_m * m.K_b / m.R_a);
  EXPECT_NEAR(plant.e_a(), 110, 1e-9);
  EXPECT_NEAR(plant.omega(), omega, 1e-9 * omega);
  EXPECT_NEAR(plant.i_a(), m.B * omega / m.K_m, 1e-9);
}

TEST(Plant, FollowsAStepAsTheLinearModelDoes) {
  PlantParameters p = servo();
  p.motor.K_m = 0.05;  // unlike K_b
  const auto& m = p.motor;
  const double rate = (m.B + m.K_m * m.K_b / m.R_a) / m.J;
  const double omega = m.K_m / m.R_a * 24 / (rate * m.J);
  Plant plant(p);
  for (int n = 1; n <= 200; ++n) {
    plant.advance(tick, 6);
    const double t = n * tick;
    ASSERT_NEAR(plant.omega(), omega * (1 - std::exp(-rate * t)), 1e-7 * omega);
    ASSERT_NEAR(plant.theta(), omega * (t - (1 - std::exp(-rate * t)) / rate), 1e-7 * omega);
  }
}

TEST(Plant, InductanceGivesTheSecondTimeConstant) {
  PlantParameters p = servo();
  p.motor.L_a = 1e-3;
  p.motor.B = 0;
  const auto& m = p.motor;
  // L J w'' + R J w' + K^2 w = K e, both roots real for this motor
  const double a = m.R_a / m.L_a;
  const double b = m.K_m * m.K_b / (m.L_a * m.J);
  const double root = std::sqrt(a * a / 4 - b);
  const double fast = a / 2 + root;
  const double slow = a / 2 - root;
  const double omega = 24 / m.K_b;
  Plant plant(p);
  for (int n = 1; n <= 300; ++n) {
    plant.advance(tick, 6);
    const double t = n * tick;
    const double w = omega * (1 - (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow));
    const double dw = omega * fast * slow * (std::exp(-slow * t) - std::exp(-fast * t)) / (fast - slow);
    ASSERT_NEAR(plant.omega(), w, 1e-6 * omega);
    ASSERT_NEAR(plant.i_a(), m.J * dw / m.K_m, 5e-5);
  }
}

TEST(Plant, AVanishingInductanceChangesNothing) {
  PlantParameters tiny = servo();
  tiny.motor.L_a = 1e-9;  // 1 ns: would need a million steps in a millisecond
  Plant with(tiny);
  Plant without(servo());
  for (int n = 0; n < 100; ++n) {
    with.advance(tick, 6);
    without.advance(tick, 6);
    ASSERT_NEAR(with.omega(), without.omega(), 1e-9);
    ASSERT_NEAR(with.i_a(), without.i_a(), 1e-9);
  }
}

TEST(Plant, AShortInductanceIsContinuousWithNone) {
  PlantParameters tiny = servo();
  tiny.motor.L_a = 1.5e-5;  // 12.5 us: just resolved
  Plant with(tiny);
  Plant without(servo());
  for (int n = 0; n < 100; ++n) {
    with.advance(tick, 6);
    without.advance(tick, 6);
    ASSERT_NEAR(with.omega(), without.omega(), 0.3);
  }
  EXPECT_NEAR(with.i_a(), without.i_a(), 1e-2);
}

TEST(Driver, SlewsUpAndDownAtItsOwnRates) {
  Plant plant(fh2());
  run(plant, 1, 6);
  EXPECT_NEAR(plant.e_a(), 22.5, 1e-9);
  run(plant, 6, 6);
  EXPECT_NEAR(plant.e_a(), 110, 1e-9);
  run(plant, 2, 0);
  EXPECT_NEAR(plant.e_a(), 110 - 2 * 20.4, 1e-9);
}

TEST(Driver, StaysWithinItsVoltages) {
  PlantParameters p = fh2();
  p.driver.rise = p.driver.fall = unlimited;
  Plant plant(p);
  plant.advance(tick, 100);
  EXPECT_EQ(plant.e_a(), 110);
  plant.advance(tick, -100);
  EXPECT_EQ(plant.e_a(), 0);
}

TEST(Driver, IgnoresItsDeadZone) {
  PlantParameters p = servo();
  p.driver.dead_zone = 0.1;
  Plant plant(p);
  for (const auto& [reference, voltage] : {std::pair{0.1, 0.0}, {-0.1, 0.0}, {0.6, 2.0}, {-0.6, -2.0}}) {
    plant.advance(tick, reference);
    EXPECT_NEAR(plant.e_a(), voltage, 1e-12);
  }
}

TEST(Driver, SagsWithItsOutputResistance) {
  PlantParameters p = servo();
  p.driver.output_resistance = 0.3;
  Plant plant(p);
  run(plant, 0.005, 3);
  EXPECT_NEAR(plant.e_a(), 12 - 0.3 * plant.i_a(), 1e-12);
  EXPECT_NEAR(plant.i_a(), (12 - 0.042 * plant.omega()) / 1.5, 1e-9);
}

TEST(Driver, HoldsItsCurrentAtItsLimitByGivingLessVoltage) {
  for (const double L_a : {0.0, 1e-3}) {
    for (const Laws laws : {Laws::usual, Laws::other}) {
      PlantParameters p = servo();
      p.laws = laws;
      p.motor.L_a = L_a;
      p.driver.current_limit = 2;
      Plant plant(p);
      run(plant, 0.02, 5);
      const double gives_way = laws == Laws::other && L_a == 0 ? 0.04 * (20 / 1.2) : 0;
      EXPECT_GE(plant.i_a(), 2 - 1e-3) << L_a;
      EXPECT_LE(plant.i_a(), 2 + 1e-3 + gives_way) << L_a;
      EXPECT_NEAR(plant.e_a(), 1.2 * plant.i_a() + 0.042 * plant.omega(), 1e-3) << L_a;
      run(plant, 2, 5);
      EXPECT_NEAR(plant.e_a(), 20, 1e-9) << "fast enough, it asks for less";
    }
  }
}

TEST(Plant, BrushesTakeTheirVoltage) {
  for (const double L_a : {0.0, 1e-3}) {
    PlantParameters p = servo();
    p.motor.brush_drop = 0.4;
    p.motor.L_a = L_a;
    for (const double reference : {-4.0, -0.3, -0.05, 0.05, 0.3, 4.0}) {
      Plant plant(p);
      run(plant, 3, reference);
      const double i = plant.i_a();
      EXPECT_NEAR(1.2 * i + 0.4 * std::tanh(i / 0.02) + 0.042 * plant.omega(), 4 * reference, 1e-6);
    }
  }
}

TEST(Plant, WindageGrowsWithTheSquareOfTheSpeed) {
  PlantParameters p = servo();
  p.motor.windage = 3e-8;
  for (const double reference : {-6.0, 6.0}) {
    Plant plant(p);
    run(plant, 3, reference);
    const double w = plant.omega();
    EXPECT_NEAR(0.042 * plant.i_a(), 1e-5 * w + 3e-8 * w * std::abs(w), 1e-9);
  }
}

TEST(Plant, TheGaugeSeesTheLoadAndNothingElse) {
  PlantParameters p = servo();
  p.load = {.torque = 0.02, .eddy_torque = 0.03, .eddy_omega = 200};
  Plant plant(p);
  EXPECT_DOUBLE_EQ(plant.load_torque(), 0.02);
  run(plant, 3, 6);
  const double x = plant.omega() / 200;
  EXPECT_NEAR(plant.load_torque(), 0.02 + 0.06 * x / (1 + x * x), 1e-12);
  EXPECT_NEAR(0.042 * plant.i_a(), plant.load_torque() + 1e-5 * plant.omega(), 1e-9);
}

TEST(Plant, AWeightPullsAtRest) {
  PlantParameters p = servo();
  p.load.torque = 0.02;
  Plant plant(p);
  run(plant, 3, 0);
  EXPECT_LT(plant.omega(), -1);
}

TEST(Plant, TheTachoLags) {
  PlantParameters p = fh2();
  p.sensors.tacho_lag = 0.03;
  Plant plant(p);
  run(plant, 4, 6);  // on the slope: 22.5 V/s over 0.6739 V s/rad
  EXPECT_NEAR(plant.omega() - plant.tacho(), 0.03 * 22.5 / 0.6739, 0.01);
  run(plant, 20, 6);
  EXPECT_NEAR(plant.tacho(), plant.omega(), 1e-9);
}

TEST(Plant, HidesWhateverATestWants) {
  PlantParameters p = servo();
  p.hidden_torque = [](double omega, double, double) { return 0.01 * std::exp(-std::pow((omega - 250) / 20, 2)); };
  Plant plant(p);
  run(plant, 3, 3);
  const double w = plant.omega();
  EXPECT_NEAR(0.042 * plant.i_a(), 1e-5 * w + 0.01 * std::exp(-std::pow((w - 250) / 20, 2)), 1e-9);
}

class DryFriction : public ::testing::TestWithParam<FrictionLaw> {};

TEST_P(DryFriction, CoastsDownInAStraightLineAndStaysAtRest) {
  PlantParameters p = with_friction(fh2(), GetParam(), 0.0547);
  p.motor.K_m = 0;  // an open armature: only friction brakes
  p.motor.B = 0;
  p.hidden_torque = [](double, double, double t) { return t < 1 ? -0.5 : 0; };
  Plant plant(p);
  run(plant, 1, 0);
  const double deceleration = 0.0547 / 3.449e-3;
  const double top = plant.omega();
  const double stop = top / deceleration;
  EXPECT_NEAR(top, (0.5 - 0.0547) / 3.449e-3, 0.1);
  for (double t = tick; t < stop - 0.01; t += tick) {
    plant.advance(tick, 0);
    ASSERT_NEAR(plant.omega(), top - deceleration * t, 0.01);
  }
  run(plant, 0.1, 0);
  const double angle = plant.theta();
  for (int n = 0; n < 60'000; ++n) {
    plant.advance(tick, 0);
    ASSERT_LT(std::abs(plant.omega()), 1e-6);
  }
  EXPECT_NEAR(plant.theta(), angle, 1e-6);
  EXPECT_EQ(plant.omega(), 0) << "not a denormal number either";
}

TEST_P(DryFriction, HoldsUntilTheBreakawayTorque) {
  const double breakaway = 31.825 * 0.0547 / 0.6739 / (110.0 / 6);  // [V] of reference
  for (const auto& [share, moves] : {std::pair{0.98, false}, {1.02, true}}) {
    Plant plant(with_friction(fh2(), GetParam(), 0.0547));
    run(plant, 60, share * breakaway);
    EXPECT_EQ(plant.omega() > 0.01, moves) << share;
    EXPECT_EQ(plant.theta() > 1e-3, moves) << share;
  }
}

TEST_P(DryFriction, DoesNotCreepUnderALoadThatItHolds) {
  PlantParameters p = with_friction(servo(), GetParam(), 0.003);
  p.load.torque = -0.002;
  Plant plant(p);
  run(plant, 1, 0);
  const double angle = plant.theta();
  for (int n = 0; n < 30'000; ++n)
    plant.advance(tick, 0.005 * std::sin(0.05 * n));  // shakes it within what friction holds
  run(plant, 1, 0);
  EXPECT_NEAR(plant.theta(), angle, 1e-5);
  EXPECT_NEAR(plant.omega(), 0, 1e-9);
}

TEST_P(DryFriction, TakesItsTorqueInBothDirections) {
  for (const double reference : {-5.0, 5.0}) {
    Plant plant(with_friction(servo(), GetParam(), 0.003));
    run(plant, 3, reference);
    const double sign = reference > 0 ? 1 : -1;
    EXPECT_NEAR(0.042 * plant.i_a(), 1e-5 * plant.omega() + sign * 0.003, 1e-9);
  }
}

TEST_P(DryFriction, StribeckNeedsMoreToBreakAwayThanToGoOn) {
  PlantParameters p = with_friction(servo(), GetParam(), 0.002, 0.002);
  p.friction.omega_s = 0.5;  // steeper than the back-EMF brakes
  const auto reference_for = [](double torque) { return 1.2 * torque / 0.042 / 4; };
  Plant plant(p);
  run(plant, 3, reference_for(0.0038));
  EXPECT_NEAR(plant.omega(), 0, 1e-6);
  run(plant, 3, reference_for(0.0042));
  EXPECT_GT(plant.omega(), 1);
}

TEST_P(DryFriction, OnlyTakesEnergy) {
  Plant plant(with_friction(servo(), GetParam(), 0.003));
  double given = 0;  // [J] to the shaft
  double angle = 0;
  for (int n = 0; n < 20'000; ++n) {
    plant.advance(1e-4, 0.3 * std::sin(2e-3 * n));
    given += 0.042 * plant.i_a() * (plant.theta() - angle);
    angle = plant.theta();
    ASSERT_LE(0.5 * 6e-5 * plant.omega() * plant.omega(), given + 1e-5);
  }
}

TEST_P(DryFriction, DoesNotDependOnTheTick) {
  Plant coarse(with_friction(servo(), GetParam(), 0.003, 0.002));
  Plant fine(with_friction(servo(), GetParam(), 0.003, 0.002));
  for (int n = 0; n < 5000; ++n) {
    const double reference = 3 * std::sin(4e-3 * n);
    coarse.advance(1e-3, reference);
    for (int k = 0; k < 40; ++k) fine.advance(2.5e-5, reference);
    ASSERT_NEAR(coarse.omega(), fine.omega(), 0.05) << n;
  }
}

INSTANTIATE_TEST_SUITE_P(Laws, DryFriction, ::testing::Values(FrictionLaw::bristle, FrictionLaw::hard),
                         [](const auto& law) { return law.param == FrictionLaw::hard ? "hard" : "bristle"; });

TEST(DryFriction, BothLawsAgreeBeyondTheBristlesGive) {
  Plant bristle(with_friction(servo(), FrictionLaw::bristle, 0.003));
  Plant hard(with_friction(servo(), FrictionLaw::hard, 0.003));
  for (int n = 0; n < 8000; ++n) {
    const double reference = 2 * std::sin(3e-3 * n);
    bristle.advance(tick, reference);
    hard.advance(tick, reference);
    ASSERT_NEAR(bristle.omega(), hard.omega(), 0.3) << n;
  }
}

TEST(Plant, ChargeIsTheIntegralOfTheCurrent) {
  Plant plant(fh2());
  run(plant, 30, 6);
  // J domega + B dtheta = K_m dq, exactly
  EXPECT_NEAR(plant.charge(), (3.449e-3 * plant.omega() + 1e-4 * plant.theta()) / 0.6739, 1e-9);
}

TEST(Plant, AnOpenArmatureShowsTheBackEmfWhileItCoasts) {
  for (const double inductance : {0.0, 0.2}) {
    PlantParameters p = with_friction(fh2(), FrictionLaw::bristle, 0.0547);
    p.motor.L_a = inductance;
    Plant plant(p);
    run(plant, 12, 6);
    plant.open_armature(true);
    const double omega = plant.omega(), charge = plant.charge();
    run(plant, 2, 6);
    EXPECT_EQ(plant.i_a(), 0);
    EXPECT_EQ(plant.charge(), charge);
    EXPECT_EQ(plant.e_a(), 0.6739 * plant.omega());
    // omega + T_c/B decays with J/B
    const double decay = std::exp(-1e-4 / 3.449e-3 * 2), asymptote = 0.0547 / 1e-4;
    EXPECT_NEAR(plant.omega(), (omega + asymptote) * decay - asymptote, 1e-4);
    plant.open_armature(false);
    run(plant, 5, 6);
    EXPECT_NEAR(plant.omega(), omega, 0.01);
  }
}

TEST(Plant, APersonMayTurnTheBrake) {
  Plant plant(fh2());
  run(plant, 12, 6);
  EXPECT_EQ(plant.load_torque(), 0);
  plant.set_load({.torque = 0.05});
  run(plant, 5, 6);
  EXPECT_EQ(plant.load_torque(), 0.05);
  EXPECT_NEAR(0.6739 * plant.i_a(), 0.05 + 1e-4 * plant.omega(), 1e-6);
  EXPECT_THROW(plant.set_load({.eddy_omega = 0}), ConfigError);
}

TEST(Plant, ARectifiedCurrentFlowsOneWayAndHeatsMoreThanItTurns) {
  for (const double inductance : {0.0, 0.2}) {
    PlantParameters p = with_friction(fh2(), FrictionLaw::bristle, 0.0547);
    p.motor.L_a = inductance;
    p.driver.rectified = 50;
    Plant plant(p);
    run(plant, 8, 4);
    const double charge = plant.charge(), heat = plant.squares();
    double smallest = 1, voltage = 0, speed = 0;
    for (int n = 0; n < 10000; ++n) {
      plant.advance(1e-4, 4);
      smallest = std::min(smallest, plant.i_a());
      voltage += plant.e_a() / 10000;
      speed += plant.omega() / 10000;
    }
    EXPECT_EQ(smallest, 0);
    const double mean = plant.charge() - charge;  // over one second
    EXPECT_NEAR(0.6739 * mean, 0.0547 + 1e-4 * speed, 1e-3) << "torque goes by the mean";
    EXPECT_NEAR(voltage, 31.825 * mean + 0.6739 * speed, 0.2) << "and so does the mean voltage";
    EXPECT_GT(std::sqrt(plant.squares() - heat) / mean, 1.3) << "pulses";
    EXPECT_GT(speed * 0.6739, 4 * 110.0 / 6) << "the crests drive it past the mean voltage";
  }
}

TEST(Plant, APhaseControlledRectifierFiresLateEnoughForItsMean) {
  PlantParameters p = fh2();
  p.motor.K_b = p.motor.K_m = 1e-6;  // a resistor
  p.driver.rectified = 50;
  p.driver.crest = 170;
  Plant plant(p);
  run(plant, 6, 3);
  const double charge = plant.charge(), heat = plant.squares();
  run(plant, 1, 3);
  const double mean = plant.charge() - charge;
  EXPECT_NEAR(mean * 31.825, 55, 0.8) << "it fires between two steps";
  // From a = acos(pi 55/170 - 1) on: rms = crest sqrt((1 - a/pi + sin(2 a)/(2 pi))/2)
  const double a = std::acos(std::numbers::pi * 55 / 170 - 1);
  const double rms = 170 * std::sqrt((1 - a / std::numbers::pi + std::sin(2 * a) / (2 * std::numbers::pi)) / 2);
  EXPECT_NEAR(std::sqrt(plant.squares() - heat) * 31.825, rms, 0.01 * rms);
}

TEST(Plant, RefusesWhatCannotBe) {
  const auto refuses = [](auto change) {
    PlantParameters p = servo();
    change(p);
    EXPECT_THROW(Plant{p}, ConfigError);
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  refuses([](auto& p) { p.motor.J = 0; });
  refuses([](auto& p) { p.motor.R_a = -1; });
  refuses([](auto& p) { p.motor.L_a = -1; });
  refuses([](auto& p) { p.motor.K_b = nan; });
  refuses([](auto& p) { p.driver.rise = 0; });
  refuses([](auto& p) { p.driver.rectified = -1; });
  refuses([](auto& p) { p.driver.min = p.driver.max = 0; });
  refuses([](auto& p) { p.friction.T_c = nan; });
  refuses([](auto& p) { p.sensors.tacho_lag = -1; });
}

TEST(Plant, IsAHundredTimesFasterThanTime) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "sanitizers take their time";
#endif
  const auto cpu = [] {
    timespec time{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
  };
  const auto us_per_ms = [&](const PlantParameters& p) {
    Plant plant(p);
    double best = 1;
    for (int n = 0; n < 20; ++n) {
      const double start = cpu();
      for (int k = 0; k < 200; ++k) plant.advance(tick, k < 100 ? 3 : -3);
      best = std::min(best, (cpu() - start) / 200);
    }
    return 1e6 * best;
  };
  PlantParameters p = with_friction(servo(), FrictionLaw::bristle, 0.003);
  EXPECT_LT(us_per_ms(p), 10);  // 1.5 measured
  p.friction.T_s = 0.001;
  p.motor.L_a = 1e-3;
  p.motor.brush_drop = 0.4;
  p.motor.windage = 3e-8;
  p.sensors.tacho_lag = 0.005;
  EXPECT_LT(us_per_ms(p), 30) << "with everything on";  // 8 measured
}

}  // namespace
}  // namespace emtb::simulated
