#pragma once

/// The small servo that the tests of the simulated devices turn.

#include <cmath>

#include "drivers/simulated/plant.h"

namespace emtb::simulated {

inline constexpr double tick = 1e-3;  // [s]

/// With an ideal driver.
inline PlantParameters servo(Laws laws = Laws::usual) {
  return {.laws = laws, .driver = {.gain = 4}, .motor = {.R_a = 1.2, .K_b = 0.042, .K_m = 0.042, .B = 1e-5, .J = 6e-5}};
}

inline void run(Plant& plant, double seconds, double reference) {
  for (int n = 0; n < std::lround(seconds / tick); ++n) plant.advance(tick, reference);
}

}  // namespace emtb::simulated
