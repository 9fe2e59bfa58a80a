#pragma once

#include "model/dual.h"
#include "model/machine/armature.h"
#include "model/machine/chopper.h"
#include "model/machine/equations.h"

namespace emtb {

/// What the current makes of the voltage of its source: a rectifier's rises at light load, a chopper's has gaps, a
/// limited source gives no more than drives its limit.
template <class Scalar>
class SourceUnderLoad {
 public:
  /// [V] that a limited source did not give at the end of the last step.
  const Scalar& withheld() const { return withheld_; }

  /// Bends the voltage over a step. @param added [V] beside the source, in the circuit
  /// @return whether it gives nothing: a chopper without a pulse
  bool bend(Ramp<Scalar>& e, const Scalar& added, const Motion<Scalar>& motion, const Armature<Scalar>& armature,
            const Balance<Scalar>& terms, const TermsThere& there) {
    if (there.light_load_rise) e += armature.light_load_rise(e.mean() + added, motion, terms);
    bool without_pulse = false;
    if (there.chopping) {
      const Scalar back_emf = armature.k_b() * motion.omega_in_middle();
      const Scalar mean = chopped(e.mean(), back_emf, terms);
      without_pulse = value_of(mean) == value_of(back_emf);
      go_through(e, mean, chopped(e.end, armature.k_b() * motion.omega_at_end(), terms));
    }
    if (there.current_limit) {
      const Scalar mean =
          e.mean() - armature.beyond_limit(e.mean() + added, motion.omega_in_middle(), motion.i_a, terms);
      limit(e.end, added, motion, armature, terms);
      go_through(e, mean, e.end - withheld_);
    }
    return without_pulse;
  }

  /// Says what a limited source does not give at the end of the step, where it would give `end`.
  void limit(const Scalar& end, const Scalar& added, const Motion<Scalar>& motion, const Armature<Scalar>& armature,
             const Balance<Scalar>& terms) {
    withheld_ = armature.beyond_limit(end + added, motion.omega_at_end(), motion.i_a, terms);
  }

 private:
  static void go_through(Ramp<Scalar>& e, const Scalar& mean, const Scalar& end) { e = {2.0 * mean - end, end}; }

  Scalar withheld_{};
};

}  // namespace emtb
