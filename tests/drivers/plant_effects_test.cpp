// Each thing that the plant can hide, against a closed form or a limit, in both laws where there are two.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "drivers/simulated/plant.h"
#include "drivers/simulated/plant_laws.h"
#include "hal/error.h"
#include "tests/drivers/servo.h"
#include "tests/model/switched_bridge.h"

namespace emtb::simulated {
namespace {

/// A body that nothing drives or brakes but what a test adds, kicked for a millisecond to about a speed.
PlantParameters free_body(double kick) {
  PlantParameters p = servo();
  p.motor.K_m = p.motor.B = 0;
  p.hidden_torque = [torque = p.motor.J * kick / tick](double, double, double t) { return t < tick ? -torque : 0; };
  return p;
}

/// [V] the terminal voltage after each millisecond of a profile
template <class Reference>
std::vector<double> voltages(const PlantParameters& p, int milliseconds, Reference reference) {
  Plant plant(p);
  std::vector<double> e;
  for (int n = 0; n < milliseconds; ++n) {
    plant.advance(tick, reference(n));
    e.push_back(plant.e_a());
  }
  return e;
}

class BothLaws : public ::testing::TestWithParam<Laws> {};
INSTANTIATE_TEST_SUITE_P(Effects, BothLaws, ::testing::Values(Laws::usual, Laws::other),
                         [](const auto& laws) { return laws.param == Laws::usual ? "usual" : "other"; });

// Driver

TEST_P(BothLaws, AnOffsetActsWhereTheReferenceIsAboveZero) {
  PlantParameters p = servo(GetParam());
  p.driver.offset = 0.5;
  Plant plant(p);
  for (const auto& [reference, voltage] : {std::pair{0.0, 0.0}, {-2.0, -8.0}, {2.0, 8.5}}) {
    plant.advance(tick, reference);
    EXPECT_NEAR(plant.e_a(), voltage, 1e-9);
  }
}

TEST(Driver, TheOtherLimitIsRoundAndNeverPassed) {
  PlantParameters p = servo(Laws::other);
  p.driver.min = 0;
  p.driver.max = 20;
  p.driver.knee = 0.4;
  const auto settled = [&](double e) { return settled_voltage(e / 4, p.driver, p.laws); };
  EXPECT_NEAR(settled(20), 20 - 0.2, 0.003) << "half of the knee where the corner would be";
  EXPECT_NEAR(settled(10), 10, 0.01);
  EXPECT_NEAR(settled(40), 20, 0.003);
  EXPECT_EQ(settled_voltage(40 / 4.0, p.driver, Laws::usual), 20);
  EXPECT_GE(settled(-5), 0);
  for (double e = 0; e < 40; e += 0.1) EXPECT_GT(settled(e + 0.1), settled(e));
}

TEST(Driver, TheOtherDeadZoneHasARoundCorner) {
  constexpr double zone = 0.1;
  EXPECT_EQ(beyond_dead_zone(0, zone, Laws::other), 0);
  EXPECT_NEAR(beyond_dead_zone(2, zone, Laws::other), 1.9, 1e-3);
  EXPECT_NEAR(beyond_dead_zone(-2, zone, Laws::other), -1.9, 1e-3);
  EXPECT_NEAR(beyond_dead_zone(zone, zone, Laws::other), zone / 20, 3e-4);
}

TEST_P(BothLaws, TheDriverLags) {
  PlantParameters p = servo(GetParam());
  p.driver.lag = 0.02;
  const auto e = voltages(p, 200, [](int) { return 3.0; });
  for (int n = 0; n < 200; ++n) {
    const double x = (n + 1) * tick / 0.02;
    const double left = GetParam() == Laws::usual ? std::exp(-x) : (1 + 2 * x) * std::exp(-2 * x);
    ASSERT_NEAR(e[static_cast<std::size_t>(n)], 12 * (1 - left), 1e-5);
  }
}

TEST(Driver, ADelayShiftsTheEdgeAsAWhole) {
  PlantParameters p = servo();
  p.driver.rise = p.driver.fall = 500;
  const auto reference = [](int n) { return n < 50 ? 3.0 : n < 51 ? 1.0 : 2.0; };
  const auto now = voltages(p, 100, reference);
  p.driver.delay = 0.0123;  // [s] between two ticks, and between two steps of the plant
  const auto later = voltages(p, 100, reference);
  p.driver.delay = 0.0120;
  const auto a_little_earlier = voltages(p, 100, reference);
  for (std::size_t n = 12; n < 100; ++n) ASSERT_NEAR(a_little_earlier[n], now[n - 12], 1e-9) << n;
  EXPECT_NEAR(a_little_earlier[13] - later[13], 0.0003 * 500, 1e-9);
}

TEST(Driver, LooksAtItsReferenceAtItsOwnMoments) {
  PlantParameters p = servo();
  p.driver.sampling = 0.01;
  const auto e = voltages(p, 30, [](int n) { return n < 4 ? 1.0 : n < 13 ? 2.0 : 3.0; });
  EXPECT_EQ(e[3], 4) << "the first look is at the start";
  EXPECT_EQ(e[9], 4) << "2 V came 4 ms later: seen at 10 ms";
  EXPECT_EQ(e[10], 8);
  EXPECT_EQ(e[19], 8);
  EXPECT_EQ(e[20], 12);
}

TEST(Driver, AWornPotentiometerTakesUpItsPlayFirst) {
  PlantParameters p = servo();
  p.driver.play = 0.2;
  Plant plant(p);
  for (const auto& [reference, seen] : {std::pair{1.0, 0.9}, {0.9, 0.9}, {0.5, 0.6}, {0.65, 0.6}, {1.0, 0.9}}) {
    plant.advance(tick, reference);
    EXPECT_NEAR(plant.e_a(), 4 * seen, 1e-12) << reference;
  }
}

TEST_P(BothLaws, DiscontinuousConductionRaisesTheVoltageAtLightLoad) {
  for (const double load : {0.0, 0.004, 0.5}) {
    PlantParameters p = servo(GetParam());
    p.driver.conduction_rise = 2;
    p.driver.conduction_current = 0.2;
    p.load.torque = load;
    p.motor.B = 0;
    Plant plant(p);
    run(plant, 15, 5);  // at no current the rise acts as a resistance: 11 ohm, 0.4 s
    const double x = load / 0.042 / 0.2;
    const double rise = GetParam() == Laws::usual ? std::exp(-x) : std::pow(std::max(1 - x / 3, 0.0), 2);
    EXPECT_NEAR(plant.e_a(), 20 + 2 * rise, 1e-6) << load;
  }
}

TEST_P(BothLaws, AChopperBendsTheVoltageAtLightLoad) {
  PlantParameters p = servo(GetParam());
  p.driver.chop_period = 0.8;
  p.driver.chop_supply = 24;
  p.load.torque = 0.01;
  Plant plant(p);
  run(plant, 5, 2);
  const double diodes = GetParam() == Laws::usual ? 0 : 0.04 * 24;
  const SwitchedBridge bridge{0.8, 24, diodes, 0.042 * plant.omega()};
  EXPECT_NEAR(plant.e_a(), bridge.mean_voltage(4 * 2.0 / 24), 2e-3);
  EXPECT_GT(plant.e_a(), 8.5) << "more than the 8 V that are asked for";
  plant.advance(tick, 0);
  EXPECT_EQ(plant.i_a(), 0) << "it takes no current back";
}

// Armature and air gap

TEST(Plant, TheOtherBrushesBendExponentially) {
  PlantParameters p = servo(Laws::other);
  p.motor.brush_drop = 0.4;
  for (const double reference : {-4.0, -0.1, 0.1, 4.0}) {
    Plant plant(p);
    run(plant, 3, reference);
    const double i = plant.i_a();
    const double drop = std::copysign(0.4 * (1 - std::exp(-std::abs(i) / 0.02)), i);
    EXPECT_NEAR(1.2 * i + drop + 0.042 * plant.omega(), 4 * reference, 1e-6);
  }
}

TEST_P(BothLaws, TheArmatureWarmsUpToWhereItLosesItsHeat) {
  PlantParameters p = servo(GetParam());
  p.motor.K_b = p.motor.K_m = 1e-9;  // a resistor
  p.motor.heat_capacity = 2;
  p.motor.heat_resistance = 1.5;
  Plant plant(p);
  run(plant, 0.1, 1.5);
  EXPECT_NEAR(plant.warmer(), 0.1 * 36 / 1.2 / (GetParam() == Laws::usual ? 2 : 1), 0.2)
      << "all heat is stored at first";
  run(plant, 40, 1.5);
  const double i = plant.i_a();
  EXPECT_NEAR(plant.warmer(), 1.5 * 6 * i, 1e-3);
  EXPECT_NEAR(6 / i, 1.2 * (1 + 0.00393 * plant.warmer()), 1e-9);
}

TEST_P(BothLaws, ArmatureReactionWeakensTheFluxOfTorqueAndBackEmfAlike) {
  PlantParameters p = servo(GetParam());
  p.motor.reaction = 0.1;
  p.motor.reaction_current = 5;
  p.load.torque = 0.2;
  Plant plant(p);
  run(plant, 3, 5);
  const double i = plant.i_a(), x = i / 5;
  const double flux = 1 - 0.1 * (GetParam() == Laws::usual ? x * x / (1 + x * x) : std::pow(std::tanh(x), 2));
  EXPECT_NEAR(0.042 * flux * i, 0.2 + 1e-5 * plant.omega(), 1e-7);
  EXPECT_NEAR(1.2 * i + 0.042 * flux * plant.omega(), 20, 1e-6);
}

TEST_P(BothLaws, TheFieldSagsAsItWarmsUp) {
  PlantParameters p = servo(GetParam());
  p.motor.B = 0;
  p.motor.field_drop = 0.05;
  p.motor.field_time = 2;
  Plant plant(p);
  run(plant, 2, 5);
  if (GetParam() == Laws::usual) {
    EXPECT_NEAR(20 / (0.042 * plant.omega()), 1 - 0.05 * (1 - std::exp(-1)), 1e-3);
  }
  run(plant, 28, 5);
  EXPECT_NEAR(20 / (0.042 * plant.omega()), 0.95, 1e-4);
}

TEST(Plant, IronRemembersTheCurrent) {
  const auto speed_after = [](double load) {
    PlantParameters p = servo();
    p.motor.B = 0;
    p.motor.flux_hysteresis = 0.05;
    p.motor.coercive_current = 0.5;
    p.load.torque = load;
    Plant plant(p);
    run(plant, 2, 3);
    plant.set_load({});
    run(plant, 2, 3);
    return plant.omega();
  };
  const double flux = 0.05 * std::tanh(1);  // both ways
  EXPECT_NEAR(speed_after(-0.1) / speed_after(0.1), (1 + flux) / (1 - flux), 2e-3);
}

// Shaft

TEST(Plant, WindageMayHaveAnotherExponent) {
  PlantParameters p = servo();
  p.motor.windage = 3e-8;
  p.motor.windage_exponent = 1.8;
  p.motor.windage_omega = 200;
  Plant plant(p);
  run(plant, 3, -6);
  const double w = plant.omega();
  EXPECT_NEAR(0.042 * plant.i_a(), 1e-5 * w - 3e-8 * 200 * 200 * std::pow(std::abs(w) / 200, 1.8), 1e-9);
}

TEST_P(BothLaws, StribeckFrictionFallsWithSpeed) {
  for (const FrictionLaw law : {FrictionLaw::bristle, FrictionLaw::hard}) {
    PlantParameters p = servo(GetParam());
    p.friction = {.law = law, .T_c = 0.002, .T_s = 0.001, .omega_s = 100};
    Plant plant(p);
    run(plant, 3, 1.1);
    const double x = plant.omega() / 100;
    const double more = 0.001 * std::exp(GetParam() == Laws::usual ? -x * x : -x);
    EXPECT_GT(x, 0.5);
    EXPECT_NEAR(0.042 * plant.i_a(), 0.002 + more + 1e-5 * plant.omega(), 1e-8);
  }
}

TEST(Plant, FrictionMayDifferBetweenTheDirections) {
  for (const FrictionLaw law : {FrictionLaw::bristle, FrictionLaw::hard}) {
    PlantParameters p = servo();
    p.friction = {.law = law, .T_c = 0.003, .T_d = 0.001, .B_d = 2e-6};
    for (const double direction : {-1.0, 1.0}) {
      Plant plant(p);
      run(plant, 3, 5 * direction);
      const double w = plant.omega();
      EXPECT_NEAR(0.042 * plant.i_a(), 1e-5 * w + 0.003 * direction + 0.001 + 2e-6 * std::abs(w), 1e-9);
    }
    Plant held(p);
    run(held, 1, 1.2 * 0.0035 / 0.042 / 4);
    EXPECT_NEAR(held.omega(), 0, 1e-6) << "holds up to T_c + T_d one way";
    run(held, 1, -1.2 * 0.0025 / 0.042 / 4);
    EXPECT_LT(held.omega(), -0.3) << "and T_c - T_d the other way";
  }
}

TEST_P(BothLaws, FrictionFallsAsItsGreaseWarmsUp) {
  PlantParameters p = servo(GetParam());
  p.friction = {.T_c = 0.003, .warm_drop = 0.4, .warm_time = 2};
  Plant plant(p);
  run(plant, 2, 5);
  const double warm = 1 - std::exp(-1);
  const double left = GetParam() == Laws::usual ? 1 - 0.4 * warm : std::pow(0.6, warm);
  EXPECT_NEAR(0.042 * plant.i_a(), left * (0.003 + 1e-5 * plant.omega()), 4e-5) << "while it still gathers speed";
  run(plant, 40, 5);
  EXPECT_NEAR(0.042 * plant.i_a(), 0.6 * (0.003 + 1e-5 * plant.omega()), 1e-8);
}

TEST(Plant, CoggingTakesAndGivesBackEnergy) {
  PlantParameters p = free_body(60);
  p.shaft = {.cogging = 0.01, .cogging_second = 0.3, .cogging_order = 6, .cogging_phase = 0.4};
  Plant plant(p);
  const auto energy = [&] {  // -dV/dtheta = torque
    const double angle = 6 * plant.theta() + 0.4;
    const double potential = -0.01 / 6 * (std::cos(angle) + 0.3 / 2 * std::cos(2 * angle + 1));
    return 0.5 * 6e-5 * plant.omega() * plant.omega() + potential;
  };
  run(plant, 0.002, 0);
  const double given = energy();
  double slowest = 1e9, fastest = 0;
  for (int n = 0; n < 500; ++n) {
    plant.advance(tick, 0);
    ASSERT_NEAR(energy(), given, 1e-6 * given);
    slowest = std::min(slowest, plant.omega());
    fastest = std::max(fastest, plant.omega());
  }
  EXPECT_GT(fastest - slowest, 0.5);
}

TEST(Plant, TwoBodiesSwingAgainstEachOtherAndShareTheirMomentum) {
  PlantParameters p = free_body(10);
  const double J = 6e-5, J_2 = 2e-5, k = 0.5;
  p.shaft = {.stiffness = k, .J_2 = J_2};
  Plant plant(p);
  const double swings = std::sqrt(k * J / (J_2 * (J - J_2)));  // [rad/s]
  run(plant, 0.001, 0);
  std::vector<double> ups;
  double before = plant.omega();
  const double mean = 10;  // all momentum over all inertia
  for (int n = 0; n < 40'000; ++n) {
    plant.advance(2.5e-5, 0);
    if (before < mean && plant.omega() >= mean) ups.push_back(plant.time());
    before = plant.omega();
  }
  ASSERT_GT(ups.size(), 10u);
  const double period = (ups.back() - ups.front()) / static_cast<double>(ups.size() - 1);
  EXPECT_NEAR(period, 2 * std::numbers::pi / swings, 1e-3 * period);
}

TEST(Plant, ACompliantShaftCarriesTheLoadAndSoDoesBacklash) {
  for (const double gap : {0.0, 0.2}) {
    PlantParameters p = servo();
    p.shaft = {.stiffness = 0.5, .damping = 1e-3, .J_2 = 2e-5, .gap = gap};
    p.load.torque = 0.02;
    Plant plant(p);
    run(plant, 4, 4);
    EXPECT_NEAR(0.042 * plant.i_a(), 0.02 + 1e-5 * plant.omega(), 1e-6) << gap;
    EXPECT_NEAR(plant.load_torque(), 0.02, 1e-12);
  }
}

TEST(Plant, WithinItsGapTheLoadIsLeftBehind) {
  PlantParameters p = free_body(10);
  p.shaft = {.stiffness = 5, .J_2 = 2e-5, .gap = 0.2};
  Plant plant(p);
  run(plant, 0.001, 0);
  const double alone = plant.omega();  // the load has not moved: all momentum is the motor's
  EXPECT_NEAR(alone, 10.0 * 6 / 4, 0.5);
  run(plant, 0.1 / alone - 0.001, 0);
  EXPECT_NEAR(plant.omega(), alone, 1e-6) << "half of the gap is not used up yet";
  run(plant, 0.004, 0);
  EXPECT_LT(plant.omega(), 0.9 * alone) << "now the teeth have met";
}

TEST_P(BothLaws, GearsRubTheMoreTheMoreTheyCarry) {
  for (const FrictionLaw law : {FrictionLaw::bristle, FrictionLaw::hard}) {
    for (const double load : {-0.05, 0.0, 0.02, 0.05}) {
      PlantParameters p = servo(GetParam());
      p.friction = {.law = law, .T_c = 0.002, .gears = 0.2};
      p.load.torque = load;
      Plant plant(p);
      run(plant, 3, 5);
      const double motor = 0.042 * plant.i_a();
      const double carried = GetParam() == Laws::usual ? std::abs(motor + load) : std::abs(motor) + std::abs(load);
      EXPECT_NEAR(motor, load + 1e-5 * plant.omega() + 0.002 + 0.2 * carried, 1e-6) << load;
    }
  }
}

// Sensors

TEST_P(BothLaws, TachoAndGaugeLagByTheirTimeConstants) {
  PlantParameters p = servo(GetParam());
  p.driver.rise = 4;  // [V/s] a slope that lasts
  p.sensors.tacho_lag = 0.02;
  p.sensors.torque_lag = 0.03;
  p.load = {.eddy_torque = 0.01, .eddy_omega = 1e5};  // as good as linear
  Plant plant(p);
  run(plant, 3, 5);
  const double acceleration = 4 / 0.042;
  EXPECT_NEAR(plant.omega() - plant.tacho(), 0.02 * acceleration, 0.01 * 0.02 * acceleration);
  EXPECT_NEAR(plant.load_torque() - plant.gauge(), 0.03 * 0.02 / 1e5 * acceleration,
              1e-2 * 0.03 * 0.02 / 1e5 * acceleration);
}

TEST(Plant, TheTachoRipplesWithTheAngle) {
  PlantParameters p = servo();
  p.sensors = {.ripple = 0.02, .ripple_second = 0.25, .ripple_order = 4, .ripple_phase = 0.7};
  Plant plant(p);
  for (int n = 0; n < 300; ++n) {
    plant.advance(tick, 2);
    const double angle = 4 * plant.theta() + 0.7;
    ASSERT_NEAR(plant.tacho(), plant.omega() * (1 + 0.02 * (std::sin(angle) + 0.25 * std::sin(2 * angle + 1))), 1e-9);
  }
}

TEST(Plant, ATachoThatSticksReadsInJumps) {
  PlantParameters p = servo();
  p.driver.rise = 8;
  p.sensors.tacho_stick = 5;
  Plant plant(p);
  int jumps = 0;
  double before = 0;
  for (int n = 0; n < 2000; ++n) {
    plant.advance(tick, 4);
    ASSERT_LE(std::abs(plant.tacho() - plant.omega()), 5.2);
    if (plant.tacho() != before) {
      EXPECT_GE(std::abs(plant.tacho() - before), 5);
      ++jumps;
    }
    before = plant.tacho();
  }
  EXPECT_NEAR(jumps, plant.omega() / 5, 3);
}

TEST(Plant, AHiddenDropTakesItsVoltage) {
  PlantParameters p = servo();
  p.load.torque = 0.1;
  p.hidden_drop = [](double i, double omega, double) { return omega > 100 ? 0.3 * i : 0; };
  Plant plant(p);
  run(plant, 3, 5);
  EXPECT_NEAR((1.2 + 0.3) * plant.i_a() + 0.042 * plant.omega(), 20, 1e-6);
}

TEST(Plant, RefusesEffectsThatCannotBe) {
  const auto refuses = [](auto change) {
    PlantParameters p = servo();
    change(p);
    EXPECT_THROW(Plant{p}, ConfigError);
  };
  refuses([](auto& p) { p.driver.delay = -1; });
  refuses([](auto& p) { p.motor.heat_capacity = 0; });
  refuses([](auto& p) { p.motor.reaction = 0.5; });
  refuses([](auto& p) { p.motor.field_drop = 1; });
  refuses([](auto& p) { p.motor.windage_exponent = 5; });
  refuses([](auto& p) { p.friction.T_d = 0.1; });
  refuses([](auto& p) { p.shaft.gap = 0.1; });
  refuses([](auto& p) { p.shaft.stiffness = 1; });
  refuses([](auto& p) { p.friction.gears = 0.1; });
  refuses([](auto& p) { p.motor.bearing_drag = -1; });
  refuses([](auto& p) { p.load.brake = -1; });
  refuses([](auto& p) { p.load.eddy_heating = -1; });
  refuses([](auto& p) { p.sensors.torque_lag = -1; });
  refuses([](auto& p) { p.sensors.delay = -1; });
}

}  // namespace
}  // namespace emtb::simulated
