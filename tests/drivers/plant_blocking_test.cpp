// Drivers that let no current flow at times.
#include <gtest/gtest.h>

#include <cmath>

#include "drivers/simulated/plant.h"
#include "tests/drivers/servo.h"

namespace emtb::simulated {
namespace {

PlantParameters with_inductance(double L_a) {
  PlantParameters p = servo();
  p.motor.L_a = L_a;
  return p;
}

TEST(Driver, OneThatTakesNoneBackDoesSoBothWays) {
  for (const double L_a : {0.0, 2e-3}) {
    PlantParameters p = with_inductance(L_a);
    p.driver.one_quadrant = true;
    Plant plant(p);
    run(plant, 0.5, -5);
    const double top = plant.omega();
    ASSERT_LT(top, -300);
    for (const double reference : {-1.0, 0.0}) {
      for (int n = 0; n < 300; ++n) {
        plant.advance(tick, reference);
        ASSERT_LE(plant.i_a(), 0) << reference;
      }
      EXPECT_LT(plant.omega(), 0.9 * top) << reference;
    }
    run(plant, 0.5, 5);
    EXPECT_NEAR(plant.omega(), -top, 0.01 * -top) << "driven the other way";
  }
}

TEST(Driver, WhatFlowsAgainstOneThatTakesNoneBackDiesAtOnce) {
  for (const double L_a : {0.0, 2e-3}) {
    for (const double then : {0.3, 0.0}) {
      PlantParameters p = with_inductance(L_a);
      p.driver.one_quadrant = true;
      Plant plant(p);
      run(plant, 0.5, 5);
      run(plant, 0.01, -5);
      ASSERT_LT(plant.i_a(), -1) << "it plugs";
      const double before = plant.omega();
      plant.advance(2 * tick, then);
      for (int n = 0; n < 200; ++n) {
        plant.advance(tick, then);
        ASSERT_GE(plant.i_a(), 0) << "L_a " << L_a;
      }
      EXPECT_GT(plant.omega(), 0.9 * before) << "it coasts, L_a " << L_a;
    }
  }
}

TEST(Driver, OneThatLetsGoAtZeroBrakesElsewhere) {
  for (const double L_a : {0.0, 2e-3}) {
    PlantParameters p = with_inductance(L_a);
    p.driver.coasts = true;
    Plant plant(p);
    run(plant, 0.5, 5);
    const double top = plant.omega();
    run(plant, 0.5, 2);
    const double lower = plant.omega();
    EXPECT_NEAR(lower, 0.4 * top, 0.01 * top);
    for (int n = 0; n < 300; ++n) {
      plant.advance(tick, 0);
      ASSERT_EQ(plant.i_a(), 0);
    }
    EXPECT_GT(plant.omega(), 0.9 * lower);
    EXPECT_NEAR(plant.e_a(), 0.042 * plant.omega(), 1e-12);
    EXPECT_FALSE(plant.armature_open()) << "that is the contactor's";
  }
}

TEST(Driver, AOneQuadrantDriverCoastsAndShowsTheBackEmf) {
  for (const double L_a : {0.0, 2e-3}) {
    PlantParameters p = with_inductance(L_a);
    p.driver.one_quadrant = true;
    Plant plant(p);
    run(plant, 1, 5);
    const double top = plant.omega();
    for (int n = 0; n < 1000; ++n) {
      plant.advance(tick, 0);
      ASSERT_GE(plant.i_a(), 0);
    }
    EXPECT_NEAR(plant.omega(), top * std::exp(-1e-5 / 6e-5), 0.01 * top) << "only viscous friction brakes";
    EXPECT_NEAR(plant.e_a(), 0.042 * plant.omega(), 1e-12);
  }
}

}  // namespace
}  // namespace emtb::simulated
