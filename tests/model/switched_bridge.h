#pragma once

#include <algorithm>

namespace emtb {

/// A bridge that is switched, watched for a period in steps so short that each is nearly straight: its supply is on for
/// a part of it, then the current runs on through diodes until it ends. All in units of the period.
struct SwitchedBridge {
  double period = 1;                             ///< in time constants of the armature
  double supply = 0, against = 0, back_emf = 0;  ///< [V]

  /// [V] Mean at the terminals, once the periods are alike.
  double mean_voltage(double on) const {
    constexpr int steps = 20000;
    const int periods = 2 + static_cast<int>(15 / period);
    double i = 0, sum = 0;  // i [V] across the resistance
    for (int n = 0; n < periods; ++n) {
      sum = 0;
      for (int k = 0; k < steps; ++k) {
        const bool pulse = k + 0.5 < on * steps;
        const double e = pulse ? supply : i > 0 ? -against : back_emf;
        const double before = i;
        i = std::max(0.0, i + (e - back_emf - i) * period / steps);
        sum += (before + i) / 2 / steps;
      }
    }
    return sum + back_emf;  // an inductance takes no mean
  }
};

}  // namespace emtb
