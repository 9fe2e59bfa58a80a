#pragma once

#include <algorithm>
#include <cmath>

#include "model/dual.h"
#include "model/effect.h"

namespace emtb {

/// [1] What the armature's own field leaves of the flux: 1 - k_i x²/(1 + x²), x = i/i_k.
template <class Scalar>
Scalar flux_left(const Balance<Scalar>& terms, const Scalar& current) {
  const Scalar share = current / terms.reaction_knee, square = share * share;
  return 1.0 - terms.reaction * square / (1.0 + square);
}

/// [A] The current that a flux leaves which it weakens itself: i = free + taken (1 - flux_left(i)). Implicit: without
/// an inductance the current follows at once, and one step after the other would swing where the flux bends by more
/// than the resistance holds.
///
/// Where there are several, the one that the current comes to as it moves on from the last: an armature with the least
/// inductance does.
/// @param free [A] with all of the flux @param taken [A] that the back-EMF of all of it takes @param from [A] the last
template <class Scalar>
Scalar current_under_reaction(const Scalar& free, const Scalar& taken, double from, const Balance<Scalar>& terms) {
  // At a fold, where the current leaps, no derivative says by how much.
  constexpr double least_slope = 0.02;
  const double k = value_of(terms.reaction), knee = value_of(terms.reaction_knee);
  const double a = value_of(free), c = value_of(taken) * k;
  double low = std::min(a, a + c), high = std::max(a, a + c), i = std::clamp(from, low, high), slope = 1;
  for (int n = 0; n < 100; ++n) {
    const double x = i / knee, square = x * x;
    const double gap = i - a - c * square / (1 + square);
    slope = std::max(least_slope, 1 - 2 * c * x / (knee * (1 + square) * (1 + square)));
    if (std::abs(gap) <= 1e-13 * (std::abs(a) + std::abs(c))) break;
    (gap > 0 ? high : low) = i;
    // Not past the next bend of the curve: there may be a crossing between.
    double next = i - std::clamp(gap / slope, -0.5 * knee, 0.5 * knee);
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (next == i) break;
    i = next;
  }
  const Scalar gap = i - free - taken * (1.0 - flux_left(terms, Scalar(i)));
  return i - gap * (1 / slope);
}

/// [A] That at the end of a step, without an inductance.
/// @param conductance [S] of the circuit @param e [V] at the terminals @param back_emf [V] of all of the flux
template <class Scalar>
Scalar reacting_current(const Scalar& conductance, const Scalar& e, const Scalar& back_emf, const Scalar& from,
                        const Balance<Scalar>& terms) {
  const Scalar taken = conductance * back_emf;
  return current_under_reaction(conductance * e - taken, taken, value_of(from), terms);
}

}  // namespace emtb
