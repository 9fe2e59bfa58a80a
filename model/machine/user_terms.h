#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "model/dual.h"
#include "model/machine/armature.h"
#include "model/machine/equations.h"
#include "model/term.h"

namespace emtb {

/// The terms of the equations that are not in the catalogue: formulas of the user, curves to be found.
template <class Scalar>
class UserTerms {
 public:
  /// @param parameter the place of its first one
  void add(const PlacedTerm& term, std::size_t parameter) {
    (term.place == TermPlace::voltage ? voltages_ : others_).push_back({&term, parameter});
  }

  bool any_voltage() const { return !voltages_.empty(); }

  /// Torques and factors on the flux act in the middle of the step.
  void apply(Equations<Scalar>& equations) {
    for (const Placed& term : others_) {
      double by_current = 0;
      const Scalar value = value_at(term, equations.middle, equations.p, by_current);
      if (term.placed->place == TermPlace::torque) {
        equations.terms.braking_torque -= value;
      } else {
        equations.terms.flux *= value;
      }
    }
  }

  /// [V] What they added to the armature's voltage in the last step.
  const Scalar& voltage() const { return voltage_; }
  void set_voltage(const Scalar& e) { voltage_ = e; }

  /// What they add to the armature's voltage, for the current that is left at the end of the step: implicit, since
  /// without an inductance the current follows at once, and a drop that is steep in it would swing. Newton's steps
  /// between bounds on a function that grows; the last one carries the derivatives.
  /// @param stopping, resistance of the armature @param omega [rad/s] in the middle: a measured one is for the load
  /// alone
  Scalar voltage_for(const Scalar& e, const Armature<Scalar>& armature, const Motion<Scalar>& motion,
                     const Equations<Scalar>& equations) {
    const Scalar stopping = armature.stopping_voltage(e, motion), resistance = armature.stopping_resistance();
    State<Scalar> x = equations.middle;
    x.omega = motion.omega_in_middle();  // a measured one is for the load alone
    Scalar sum(0.0);
    double v = value_of(voltage_), slope = 1, low = -infinity, high = infinity;
    for (int n = 0; n < 60; ++n) {
      x.i_a = (stopping + v) / resistance;
      sum = Scalar(0.0);
      double by_current = 0;
      for (const Placed& term : voltages_) sum += value_at(term, x, equations.p, by_current);
      slope = 1 - by_current / value_of(resistance);
      const double gap = v - value_of(sum);
      if (!(slope > 0) || !std::isfinite(gap)) {  // a source that outgrows its own current: explicit
        slope = 1;
        v = value_of(sum);
        break;
      }
      if (std::abs(gap) <= 1e-13 * (std::abs(v) + std::abs(value_of(stopping)))) break;
      (gap > 0 ? high : low) = v;
      double next = v - gap / slope;
      if (!(next > low && next < high)) next = std::isfinite(high - low) ? 0.5 * (low + high) : v - gap;
      if (next == v) break;
      v = next;
    }
    return v + (sum - value_of(sum)) * (1 / slope);  // where the voltage jumps, v is what holds the current there
  }

 private:
  struct Placed {
    const PlacedTerm* placed;
    std::size_t parameter;
  };

  /// A term at a state, with all derivatives; by_current: by the current alone.
  Scalar value_at(const Placed& term, const State<Scalar>& x, std::span<const Scalar> p, double& by_current) {
    const TermInput at{value_of(x.omega), value_of(x.i_a), value_of(x.theta), x.u_ref, x.t};
    const std::size_t count = term.placed->parameter_count;
    values_.resize(count);
    by_parameter_.resize(count);
    for (std::size_t i = 0; i < count; ++i) values_[i] = value_of(p[term.parameter + i]);
    TermInput by{};
    const double value = term.placed->term->evaluate(at, values_, by, by_parameter_);
    Scalar sum(value);
    if (by.omega != 0) sum += by.omega * (x.omega - at.omega);
    if (by.i_a != 0) sum += by.i_a * (x.i_a - at.i_a);
    if (by.theta != 0) sum += by.theta * (x.theta - at.theta);
    for (std::size_t i = 0; i < count; ++i) {
      if (by_parameter_[i] != 0) sum += by_parameter_[i] * (p[term.parameter + i] - values_[i]);
    }
    by_current += by.i_a;
    return sum;
  }

  std::vector<Placed> others_, voltages_;
  Scalar voltage_{};
  std::vector<double> values_, by_parameter_;  ///< kept, to spare allocations
};

}  // namespace emtb
