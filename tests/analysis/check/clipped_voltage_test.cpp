#include "analysis/check/clipped_voltage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace emtb {
namespace {

constexpr double R = 1.2, K = 0.04, tau = 0.05, row = 0.002;  // [ohm], [V s/rad], [s]

/// A motor at voltages in steps up to 20 V, whose driver gives `gives` at most and whose reading ends at `reads`.
emtb::Run driven(double gives, double reads) {
  emtb::Run run;
  double omega = 0;
  for (int k = 0; k < 2000; ++k) {
    const double asked = 4.0 * (1 + k / 200 % 5), e = std::min(asked, gives);
    omega += row / tau * (0.9 * e / K - omega);
    const auto add = [&](Signal signal, double value) {
      run.signals[signal].t.push_back(row * k);
      run.signals[signal].value.push_back(value);
    };
    add(Signal::e_a, std::min(e, reads));
    add(Signal::i_a, (e - K * omega) / R);
    add(Signal::omega, omega);
  }
  return run;
}

TEST(ClippedVoltage, IsToldByAMotorThatTakesMore) { EXPECT_TRUE(motor_takes_more(driven(20, 12), 12)); }

TEST(ClippedVoltage, IsNotThatOfADriverThatGivesNoMore) { EXPECT_FALSE(motor_takes_more(driven(12, 20), 12)); }

TEST(ClippedVoltage, IsNotToldWithoutACurrent) {
  emtb::Run run = driven(20, 12);
  run.signals.erase(Signal::i_a);
  EXPECT_FALSE(motor_takes_more(run, 12));
}

}  // namespace
}  // namespace emtb
