#pragma once

#include "model/dual.h"
#include "model/effect.h"

namespace emtb {

/// [V] The mean that a chopper leaves at the armature, whose current has gaps at light load. For a part D of its period
/// the supply V_s is on; then the current runs on against V_off for a part d, until it ends or the period does; then
/// the terminals show the back-EMF E:
///
///     D = |asked|/V_s,  d = min(ln(1 + (V_s - E)/(V_off + E) (1 - exp(-r D)))/r, 1 - D)
///     e = D V_s - d V_off + (1 - D - d) E
///
/// It is exact for a speed that stays over a period of r time constants L_a/R_a.
/// @param asked [V] in the mean, were the current to flow all the time and run on freely
/// @return back_emf, where no current flows
template <class Scalar>
Scalar chopped(const Scalar& asked, const Scalar& back_emf, const Balance<Scalar>& terms) {
  const double way = value_of(asked) < 0 ? -1 : 1;
  const Scalar E = way * back_emf, V_s = terms.chop_supply, V_off = terms.chop_decay, r = terms.chop_period;
  const Scalar D = smaller(way * asked / V_s, Scalar(1.0));
  if (value_of(D) == 0 || value_of(E) >= value_of(V_s)) return back_emf;
  Scalar runs_on = 1.0 - D;
  if (value_of(V_off + E) > 0) {
    runs_on = smaller(log(1.0 + (V_s - E) / (V_off + E) * (1.0 - exp(-r * D))) / r, runs_on);
  }
  return way * (D * V_s - runs_on * V_off + (1.0 - D - runs_on) * E);
}

}  // namespace emtb
