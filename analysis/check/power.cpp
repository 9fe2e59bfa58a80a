#include "analysis/check/power.h"

#include "analysis/check/lost_sign.h"
#include "analysis/check/readings.h"

namespace emtb {
namespace {

/// Below zero without doubt: 0.3 of what the column could explain at the most.
bool negative(const Share& s) { return s.t < -6 && s.partial < -0.3; }
bool positive(const Share& s) { return s.t > 6 && s.partial > 0.3; }

constexpr double clear = 0.3;  // of a correlation without its means

std::optional<Signal> turned(const MotionWindows& w, const MotorBalance& b) {
  // The speed goes against the voltage; but a controller that overshoots sends what it will follow half a swing later.
  const bool against = w.voltage && b.driven < -clear && b.sped_up < clear;
  if (!w.current) return against ? w.speed : std::nullopt;
  if (!w.voltage) {
    return negative(b.inertia) && b.back_power < 0 ? std::optional(Signal::i_a) : std::nullopt;
  }
  if (against && b.power_in < 0 && b.back_power > 0) return w.voltage;
  // A load that drives the motor backwards, as a weight that is let down, turns no sign of the balances.
  if (against) return negative(b.inertia) || negative(b.back_emf) ? w.speed : std::nullopt;
  // A weak current may have an offset larger than itself, so the power alone does not do.
  const bool backwards = (b.power_in < 0 && b.back_power < 0) || negative(b.inertia);
  const bool by_balance = negative(b.resistance) && !positive(b.inertia) && (b.power_in < 0 || b.back_power < 0);
  const bool slows = negative(b.inertia) || b.pulled < -clear;  // a short run has too few windows for the balance
  const bool by_power = b.power_in < -clear && b.back_power < -clear && slows;
  if (b.driven > clear && backwards && (by_balance || by_power)) return Signal::i_a;
  return std::nullopt;
}

std::string why(Signal signal, const MotionWindows& w) {
  if (signal == Signal::i_a) {
    if (w.voltage && never_below_zero(w)) {
      return "i_a is never negative though " + name_of(*w.voltage) +
             " drives the motor backwards: if only its size was logged, give it the sign that it had; if its sign is "
             "turned, turn it (scale: -1)";
    }
    return w.voltage ? "i_a flows against the voltage and the acceleration: turn its sign (scale: -1)"
                     : "the shaft speeds up where i_a is negative: turn the sign of i_a or of the speed (scale: -1)";
  }
  const std::string name = name_of(signal);
  if (signal == w.speed) {
    return (signal == Signal::theta ? name + " falls where " : name + " is negative where ") + name_of(*w.voltage) +
           " is positive: turn the sign of one of them (scale: -1)";
  }
  return name + " is negative where the motor is driven forwards: turn its sign (scale: -1)";
}

/// What the gauge reads brakes where it is positive and the shaft turns forwards.
bool torque_turned(const MotionWindows& w, const MotorBalance& b) {
  if (!w.torque || !w.current) return false;
  double to = 0, tt = 0, oo = 0;
  for (const MotionWindow& m : w.all) to += m.torque * m.speed, tt += m.torque * m.torque, oo += m.speed * m.speed;
  return tt > 0 && oo > 0 && to < 0 && b.torque.t < -10 && b.torque.partial < -0.6 && !negative(b.resistance);
}

}  // namespace

DataFindings turned_signs(const MotionWindows& w, const MotorBalance& b, const std::string& run, double duration) {
  DataFindings findings = lost_sign(w, run, duration);
  if (!findings.empty() || w.all.size() < 10 || !w.starts_at_rest) return findings;
  const auto found = turned(w, b);
  if (found) findings.push_back({run, *found, Flaw::sign, 0, duration, why(*found, w), true});
  if (found != Signal::i_a && torque_turned(w, b)) {
    findings.push_back({run, Signal::torque, Flaw::sign, 0, duration,
                        "torque is negative where it loads the motor: what brakes a forward turn is positive; turn its "
                        "sign (scale: -1)",
                        true});
  }
  return findings;
}

}  // namespace emtb
