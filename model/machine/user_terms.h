#pragma once

#include <cmath>
#include <cstddef>
#include <vector>

#include "model/dual.h"
#include "model/machine/armature.h"
#include "model/machine/equations.h"
#include "model/machine/memory.h"
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

  /// What they remember where a run begins: what lasts there. @param equations with the state that it begins in
  void start(const Equations<Scalar>& equations) {
    for (std::vector<Placed>* terms : {&others_, &voltages_}) {
      for (Placed& term : *terms) {
        if (term.placed->rate) term.remembered.end = lasting_memory<Scalar>(rate_of(term, equations));
      }
    }
  }

  bool any_voltage() const { return !voltages_.empty(); }

  /// Torques and factors on the flux act in the middle of the step. What is remembered goes on by the step.
  void apply(Equations<Scalar>& equations) {
    for (std::vector<Placed>* terms : {&others_, &voltages_}) {
      for (Placed& term : *terms) {
        if (!term.placed->rate) continue;
        term.remembered = remembered_after(term.remembered.end, equations.middle.h, rate_of(term, equations));
      }
    }
    for (const Placed& term : others_) {
      const Scalar value = value_at(term, equations.middle, equations.p);
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
      for (const Placed& term : voltages_) {
        sum += value_at(term, x, equations.p);
        by_current += by_.i_a;
      }
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
    Remembered<Scalar> remembered{};
  };

  /// dz/dt of what a term remembers in the middle of the step, over z.
  auto rate_of(const Placed& term, const Equations<Scalar>& equations) {
    return [this, &term, &equations](double z, double& slope) {
      const Scalar rate = evaluated(*term.placed->rate, term, equations.middle, Scalar(z), equations.p);
      slope = by_.memory;
      return rate;
    };
  }

  Scalar value_at(const Placed& term, const State<Scalar>& x, std::span<const Scalar> p) {
    return evaluated(*term.placed->term, term, x, term.remembered.in_middle, p);
  }

  /// One of a term's formulas at a state, with all derivatives; by_: those with respect to the state.
  Scalar evaluated(const Term& formula, const Placed& term, const State<Scalar>& x, const Scalar& memory,
                   std::span<const Scalar> p) {
    const TermInput at{value_of(x.omega), value_of(x.i_a), value_of(x.theta), x.u_ref, x.t, value_of(memory)};
    const std::size_t count = term.placed->parameter_count;
    values_.resize(count);
    by_parameter_.resize(count);
    for (std::size_t i = 0; i < count; ++i) values_[i] = value_of(p[term.parameter + i]);
    by_ = {};
    const double value = formula.evaluate(at, values_, by_, by_parameter_);
    Scalar sum(value);
    if (by_.omega != 0) sum += by_.omega * (x.omega - at.omega);
    if (by_.i_a != 0) sum += by_.i_a * (x.i_a - at.i_a);
    if (by_.theta != 0) sum += by_.theta * (x.theta - at.theta);
    if (by_.memory != 0) sum += by_.memory * (memory - at.memory);
    for (std::size_t i = 0; i < count; ++i) {
      if (by_parameter_[i] != 0) sum += by_parameter_[i] * (p[term.parameter + i] - values_[i]);
    }
    return sum;
  }

  std::vector<Placed> others_, voltages_;
  Scalar voltage_{};
  TermInput by_;
  std::vector<double> values_, by_parameter_;  ///< kept, to spare allocations
};

}  // namespace emtb
