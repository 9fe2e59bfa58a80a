#include "analysis/check/swapped.h"

#include "analysis/check/readings.h"

namespace emtb {
namespace {

bool sure(const Share& s, double sign) { return sign * s.t > 10 && sign * s.partial > 0.6; }

}  // namespace

DataFindings swapped(const MotionWindows& w, const MotorBalance& b, const std::string& run, double duration) {
  constexpr double goes_with = 0.5;  // of a correlation without its means: a voltage mostly goes with the speed
  if (!w.current || w.voltage != Signal::e_a || !sure(b.resistance, 1) || !sure(b.back_emf, -1)) return {};
  if (b.back_power < goes_with || b.driven < 0 || b.driven > b.back_power) return {};
  const double R_a = 1 / b.resistance.value, K_b = -b.back_emf.value * R_a;
  return {{run, Signal::e_a, Flaw::scale, 0, duration,
           "e_a = " + short_number(b.resistance.value) + " ohm i_a - " + short_number(-b.back_emf.value) +
               " V s/rad omega, which no motor does: e_a and i_a seem to be swapped (then R_a = " + short_number(R_a) +
               " ohm, K_b = " + short_number(K_b) + " V s/rad). Swap their columns with --map",
           true}};
}

}  // namespace emtb
