#pragma once

#include "model/effect.h"
#include "model/machine/blocked_current.h"
#include "model/machine/driver.h"
#include "model/machine/equations.h"
#include "model/structure.h"

namespace emtb {

/// [A] With which a run begins: as it was read; else, of a shaft that is on its way, what the voltage and the back-EMF
/// drive through R_a; else none.
template <class Scalar>
Scalar first_current(const ModelStructure& structure, const Equations<Scalar>& equations, const Driver<Scalar>& driver,
                     const Scalar& omega, const InitialState& initial, const StepInput& in) {
  const bool on_the_way = initial.as_read && initial.omega != 0;
  if (initial.i_a || !on_the_way) return Scalar(initial.i_a.value_or(0));
  if (structure.input == Signal::i_a) return Scalar(in.i_a);
  const Scalar back_emf = equations.p[base::K_b] * omega;
  const Scalar e = structure.measured_voltage ? Scalar(in.e_a_end) : driver.chopped_voltage(equations.terms, back_emf);
  const Scalar current = (e - back_emf) / equations.p[base::R_a];
  const int way = way_of_current(structure.driver, value_of(e));
  const bool blocked = in.armature_open || (equations.terms.lets_go && value_of(e) == 0) ||
                       (equations.terms.one_quadrant && way * value_of(current) <= 0);
  const Scalar& limit = equations.terms.current_limit;
  return blocked ? Scalar(0.0) : clamped(current, -limit, limit);
}

}  // namespace emtb
