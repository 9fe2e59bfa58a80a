#pragma once

#include <algorithm>
#include <cmath>

#include "drivers/simulated/plant_parameters.h"

/// The plant's laws, each as a function of what it depends on. Where Laws has a choice, both stand side by side.
namespace emtb::simulated {

/// tanh to within 1e-16 absolute, in half the time of the library's, which is exact to its last digit near zero, too.
inline double saturation(double x) noexcept { return 1 - 2 / (std::exp(2 * x) + 1); }

/// The lesser of two, rounded over a width w: off by w/2 where they are equal, by w^2/(4 distance) far from there.
inline double rounded_min(double a, double b, double w) noexcept {
  return w > 0 ? (a + b - std::sqrt((a - b) * (a - b) + w * w)) / 2 : std::min(a, b);
}

/// [V] The reference less the dead zone.
inline double beyond_dead_zone(double reference, double zone, Laws laws) noexcept {
  if (zone == 0) return reference;
  const double size = std::abs(reference);
  if (laws == Laws::usual) return std::copysign(std::max(size - zone, 0.0), reference);
  const auto corner = [w = 0.1 * zone](double x) { return (x + std::sqrt(x * x + w * w)) / 2; };
  return std::copysign(corner(size - zone) - corner(-zone), reference);
}

/// Within [min, max], with the driver's knee.
inline double limited(double e, const DriverParameters& driver, Laws laws) noexcept {
  if (laws == Laws::usual || driver.knee == 0) return std::clamp(e, driver.min, driver.max);
  return std::max(-rounded_min(-driver.min, -rounded_min(e, driver.max, driver.knee), driver.knee), driver.min);
}

/// [V] A settled driver's output before its slopes, lags and resistance.
inline double settled_voltage(double reference, const DriverParameters& driver, Laws laws) noexcept {
  double e = driver.gain * beyond_dead_zone(reference, driver.dead_zone, laws);
  if (reference > 0) e += driver.offset * (laws == Laws::usual ? 1 : 1 - std::exp(-reference / 0.05));
  return limited(e, driver, laws);
}

/// [V] What discontinuous conduction adds to the output.
inline double conduction_rise(double i, const DriverParameters& driver, Laws laws) noexcept {
  const double x = std::abs(i) / driver.conduction_current;
  if (laws == Laws::usual) return driver.conduction_rise * std::exp(-x);
  const double left = std::max(1 - x / 3, 0.0);
  return driver.conduction_rise * left * left;
}

/// [V] The mean that a chopper leaves at the armature: pulses of the supply, then the current runs on until it ends,
/// then the back-EMF.
inline double chopped(double mean, double back_emf, const DriverParameters& driver, Laws laws) noexcept {
  const double way = std::copysign(1.0, mean), own = way * back_emf, supply = driver.chop_supply;
  const double on = std::min(std::abs(mean) / supply, 1.0), off = 1 - on;
  if (on == 0 || own >= supply) return back_emf;
  const double against = driver.chop_decay + (laws == Laws::usual ? 0 : 0.04 * supply), opposes = own + against;
  const double peak = (supply - own) * -std::expm1(-driver.chop_period * on);  // [V] across the resistance
  const double ends = opposes > 0 ? std::log1p(peak / opposes) / driver.chop_period : off;
  const double flows = std::min(ends, off);
  return way * (on * supply - flows * against + (off - flows) * own);
}

/// [A] What a source that limits its current lets through of one that would flow.
inline double let_through(double i, const DriverParameters& driver, Laws laws) noexcept {
  const double gives_way = laws == Laws::usual ? 0 : 0.04;
  const double beyond = std::max(0.0, std::abs(i) - driver.current_limit);
  return i - std::copysign((1 - gives_way) * beyond, i);
}

/// How much of the brushes' drop there is at a current, and how that grows with x = i/i_b.
struct Contact {
  double share = 0;  ///< -1 to 1
  double slope = 0;
};
inline Contact contact(double x, Laws laws) noexcept {
  if (laws == Laws::usual) {
    const double bend = saturation(x);
    return {bend, 1 - bend * bend};
  }
  const double gap = std::exp(-std::abs(x));
  return {std::copysign(1 - gap, x), gap};
}

/// The part of the flux that the armature's field takes.
inline double reaction(double i, const MotorParameters& motor, Laws laws) noexcept {
  const double x = i / motor.reaction_current;
  if (laws == Laws::usual) return motor.reaction * x * x / (1 + x * x);
  const double bend = saturation(x);
  return motor.reaction * bend * bend;
}

/// What is left of the flux when the field has been on for a time.
inline double field(double t, const MotorParameters& motor, Laws laws) noexcept {
  const double cold = std::exp(-t / motor.field_time);
  if (laws == Laws::usual) return 1 - motor.field_drop * (1 - cold);
  const double warm = 1 - 0.6 * cold - 0.4 * cold * cold * cold;  // winding and iron
  return 1 / (1 + motor.field_drop / (1 - motor.field_drop) * warm);
}

/// What is left of the friction when the shaft has turned for a time.
inline double grease(double t, const FrictionParameters& friction, Laws laws) noexcept {
  const double warm = 1 - std::exp(-t / friction.warm_time);
  return laws == Laws::usual ? 1 - friction.warm_drop * warm : std::pow(1 - friction.warm_drop, warm);
}

/// How much of the Stribeck torque there is at a speed.
inline double stribeck(double omega, const FrictionParameters& friction, Laws laws) noexcept {
  const double x = omega / friction.omega_s;
  return std::exp(laws == Laws::usual ? -x * x : -std::abs(x));
}

/// [N m]
inline double windage(double omega, const MotorParameters& motor) noexcept {
  const double square = motor.windage * omega * std::abs(omega);
  if (motor.windage_exponent == 2 || omega == 0) return square;
  return square * std::pow(std::abs(omega) / motor.windage_omega, motor.windage_exponent - 2);
}

/// sin(a) and some of sin(2 a), of which the second is turned by a radian: no symmetry that helps anybody.
inline double harmonics(double angle, double second) noexcept {
  return std::sin(angle) + (second == 0 ? 0 : second * std::sin(2 * angle + 1));
}

}  // namespace emtb::simulated
