#include "paper/switch_on.h"

#include <gtest/gtest.h>

#include <cmath>

namespace emtb::paper {
namespace {

/// Without friction the start is an exponential: all that SwitchOn says can be written down.
TEST(SwitchOn, SaysWhatAnExponentialStartDoes) {
  simulated::PlantParameters plant;
  plant.driver.gain = 110.0 / 6;
  plant.motor = {.R_a = 31.825, .K_b = 0.6739, .K_m = 0.6739, .J = 3.449e-3};
  const SwitchOn start(plant, 3);
  const double tau = plant.motor.R_a * plant.motor.J / (0.6739 * 0.6739), peak = 110 / 31.825;
  EXPECT_NEAR(start.peak_current(), peak, 0.002);
  EXPECT_NEAR(start.peak_acceleration(), 0.6739 * peak / 3.449e-3, 0.5);
  const auto mean = [&](double window) { return peak * tau / window * (1 - std::exp(-window / tau)); };
  EXPECT_NEAR(start.mean_current(0, 0.4), mean(0.4), 1e-4);
  EXPECT_NEAR(start.mean_current(-0.2, 0.4), mean(0.2) / 2, 1e-4) << "nothing flows before the switch-on";
  EXPECT_NEAR(start.mean_acceleration(0.4), 110 / 0.6739 * (1 - std::exp(-0.4 / tau)) / 0.4, 0.05);
  EXPECT_NEAR(start.largest_reading(0.4, 0), mean(0.4), 1e-4);
  EXPECT_LT(start.largest_reading(0.4, 0.5), mean(0.4));
  EXPECT_NEAR(mean(start.window_for(1.73)), 1.73, 1e-3);
}

TEST(SwitchOn, AnInductanceLowersThePeakToAnyCurrent) {
  simulated::PlantParameters plant;
  plant.driver.gain = 110.0 / 6;
  plant.motor = {.R_a = 31.825, .K_b = 0.6739, .K_m = 0.6739, .J = 3.449e-3};
  plant.motor.L_a = inductance_for(plant, 2.5);
  EXPECT_NEAR(SwitchOn(plant, 2).peak_current(), 2.5, 0.01);
}

}  // namespace
}  // namespace emtb::paper
