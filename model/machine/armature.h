#pragma once

#include <algorithm>
#include <cmath>

#include "model/dual.h"
#include "model/machine/equations.h"
#include "model/structure.h"

namespace emtb {

/// [V] over a step: linear, with the right mean and end.
template <class Scalar>
struct Ramp {
  Scalar start{}, end{};

  Scalar mean() const { return 0.5 * (start + end); }
  Ramp& operator+=(const Scalar& e) { return start += e, end += e, *this; }
  Ramp& operator-=(const Scalar& e) { return start -= e, end -= e, *this; }
};

/// A current as the armature circuit answers: v0 and v1 across R and L at the start and the end of a step, i at its
/// start.
template <class Scalar>
struct Response {
  Scalar v0{}, v1{}, i{};
};

/// What makes a current in the armature.
enum class Circuit {
  closed,  ///< the voltage drives one
  driven,  ///< a current drive does
  open,    ///< none: its terminals are open
  blocked  ///< none: the driver takes no current back
};

/// The armature circuit, solved exactly for voltages that are linear over the step.
///
///     e = R i + L di/dt + K_b φ ω + V tanh(i/i_knee)
///
/// What depends on R, L, φ and the length of the step only is kept until one of these changes.
template <class Scalar>
class Armature {
 public:
  /// Where does something differ from what it is solved for?
  auto changed(const Scalar& resistance, const Balance<Scalar>& terms) const {
    return circuit_changed(resistance, terms) | differs(terms.flux, flux_);
  }
  auto circuit_changed(const Scalar& resistance, const Balance<Scalar>& terms) const {
    return differs(resistance, resistance_) | differs(terms.inductance, inductance_);
  }

  void solve(const Scalar& resistance, const Equations<Scalar>& equations, double h, bool conducts) {
    resistance_ = resistance;
    inductance_ = equations.terms.inductance;
    flux_ = equations.terms.flux;
    k_b_ = equations.p[base::K_b] * flux_;
    k_m_ = equations.p[base::K_m] * flux_;
    mean_ = end_ = Response<Scalar>{};
    inductive_ = any(differs(inductance_, Scalar(0.0)));
    if (!conducts) return;
    // R i + L di/dt = v, v linear from v0 to v1: i(h) = v1/R - trail + (i - v0/R + trail) carried, trail = (v1 - v0)
    // lag/R.
    const Scalar conductance = 1.0 / resistance;
    Scalar lag(0.0), carried(0.0);  // L/R in steps; how much of an initial current is left at the end
    if (inductive_) {
      const Scalar tau = inductance_ * conductance;
      lag = tau / h;
      carried = decay(h, tau);
      holding_ = carried / (1.0 - carried) * resistance;
    }
    const Scalar mean_carried = lag * (1.0 - carried);
    end_ = {(mean_carried - carried) * conductance, (1.0 - mean_carried) * conductance, carried};
    const Scalar late = lag * (1.0 - mean_carried);
    mean_ = {(0.5 + late - mean_carried) * conductance, (0.5 - late) * conductance, mean_carried};
  }

  bool inductive() const { return inductive_; }
  const Scalar& k_b() const { return k_b_; }  ///< [V s/rad] K_b φ
  const Scalar& k_m() const { return k_m_; }  ///< [N m/A] K_m φ

  /// [A] Mean over the step, less what the speed at its end will add.
  const Response<Scalar>& mean() const { return mean_; }
  Scalar mean_current(const Scalar& v0, const Scalar& v1, const Scalar& i_a) const {
    Scalar current = mean_.v0 * v0 + mean_.v1 * v1;
    if (inductive_) current += mean_.i * i_a;
    return current;
  }

  /// The same at the end of the step.
  const Response<Scalar>& end() const { return end_; }

  /// [A] At the end of the step.
  Scalar end_current(const Scalar& v0, const Scalar& v1, const Scalar& i_a) const {
    return inductive_ ? end_.v0 * v0 + end_.v1 * v1 + end_.i * i_a : end_.v1 * v1;
  }

  /// The voltage that is left for a current at the end of the step, counted so that 0 leaves none.
  /// @param e [V] mean over the step
  Scalar stopping_voltage(const Scalar& e, const Motion<Scalar>& motion) const {
    const Scalar left = e - k_b_ * motion.omega_in_middle();
    return inductive_ ? left + holding_ * motion.i_a : left;
  }

  /// [ohm] what a current at the end of the step costs of that voltage, per ampere.
  Scalar stopping_resistance() const { return inductive_ ? resistance_ + holding_ : resistance_; }

  /// [V] What a source that limits its current takes from its voltage: all that would drive more.
  Scalar beyond_limit(const Scalar& e, const Scalar& omega, const Scalar& i_a, const Balance<Scalar>& terms) const {
    Scalar stopping = e - k_b_ * omega;
    if (inductive_) stopping += holding_ * i_a;
    const Scalar most = stopping_resistance() * terms.current_limit + terms.contact_drop;
    return stopping - clamped(stopping, -most, most);
  }

  /// What the output of a rectifier rises by as the current gets gaps: V exp(-|i|/i_c), implicit.
  Scalar light_load_rise(const Scalar& e, const Motion<Scalar>& motion, const Balance<Scalar>& terms) const {
    if (value_of(e) <= 0) return Scalar(0.0);
    const Scalar stopping = stopping_voltage(e, motion), knee = stopping_resistance() * terms.light_load_current;
    const double s = value_of(stopping), k = value_of(knee), v = value_of(terms.light_load_rise);
    const double way = flows_back(s, k, v, value_of(motion.i_a)) ? -1 : 1;  // of the current
    // Newton's steps on a convex function, from where they cannot overshoot: no rise.
    double rise = 0;
    for (int n = 0; n < 30; ++n) {
      const double gone = v * std::exp(-std::max(0.0, way * (s + rise)) / k);
      const double slope = way * (s + rise) > 0 ? way * gone / k : 0;
      const double change = (gone - rise) / std::max(least_slope, 1 + slope);
      rise += change;
      if (std::abs(change) < 1e-13 * v) break;
    }
    const Scalar gone = terms.light_load_rise * exp(-larger(way * (stopping + rise), Scalar(0.0)) / knee);
    const Scalar slope = way * (s + rise) > 0 ? way * gone / knee : Scalar(0.0);
    return rise + (gone - rise) / larger(1.0 + slope, Scalar(least_slope));
  }

  /// What the brushes take of the voltage: V tanh(i/i_knee), for the current that is left at the end of the step.
  /// Implicit, since the knee is steep.
  Scalar contact_drop(const Scalar& e, const Motion<Scalar>& motion, const Balance<Scalar>& terms) const {
    const Scalar stopping = stopping_voltage(e, motion), knee = stopping_resistance() * terms.contact_knee;
    // Newton's steps from above on a convex function: they cannot overshoot. The last one carries the derivatives.
    const double s = value_of(stopping), k = value_of(knee), v = value_of(terms.contact_drop);
    double drop = clamped(s * v / (k + v), -v, v);
    for (int n = 0; n < 20; ++n) {
      const double bend = saturation((s - drop) / k);
      const double change = (drop - v * bend) / (1 + v / k * (1 - bend * bend));
      drop -= change;
      if (std::abs(change) < 1e-13 * v) break;
    }
    const Scalar bend = saturation((stopping - drop) / knee);
    return drop - (drop - terms.contact_drop * bend) / (1.0 + terms.contact_drop / knee * (1.0 - bend * bend));
  }

 private:
  /// A current that flows back is driven by less the less of it there is, so that two may be possible: then it flows on
  /// as before.
  /// @param s, k, v [V] that stops it, at which the rise has fallen to 1/e, and the rise at no current
  static bool flows_back(double s, double k, double v, double i_a) {
    const bool forth_is_possible = s + v >= 0;
    const bool back_is_possible = v <= k ? !forth_is_possible : s <= k * (std::log(k / v) - 1);
    return !forth_is_possible || (back_is_possible && i_a < 0);
  }

  /// Where a current that flows back is about to turn, it does so at once.
  static constexpr double least_slope = 1e-3;

  Scalar resistance_{}, inductance_{}, flux_{};  ///< that it is solved for
  Scalar k_b_{}, k_m_{};
  bool inductive_ = false;  ///< false: no inductance, and its terms are not computed
  Scalar holding_{};        ///< [ohm] voltage that stops a current within the step, per ampere
  Response<Scalar> mean_, end_;
};

}  // namespace emtb
