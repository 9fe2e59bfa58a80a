#pragma once

#include <cmath>
#include <span>

#include "model/dual.h"
#include "model/term.h"

namespace emtb {

/// What a term remembers, after a step and in its middle.
template <class Scalar>
struct Remembered {
  Scalar end{}, in_middle{};
};

inline constexpr int most_memory_steps = 20;            ///< of Newton's
inline constexpr double settled_memory_change = 1e-12;  ///< as a share of what is remembered

/// Moves on z, which follows dz/dt = rate(z), by the implicit midpoint rule; where z follows within less than half a
/// step, which that would make swing, it has followed at the end. The last of Newton's steps carries the derivatives.
/// @param rate (double z, double& slope) -> Scalar in the middle of the step, with its slope over z
template <class Scalar, class Rate>
Remembered<Scalar> remembered_after(const Scalar& memory, double h, const Rate& rate) {
  const double z = value_of(memory);
  double end = z, ahead = 0.5, slope = 0;
  Scalar at_middle(0.0);
  for (int n = 0; n < most_memory_steps; ++n) {
    at_middle = rate((1 - ahead) * z + ahead * end, slope);
    const double gap = end - z - h * value_of(at_middle);
    if (!(ahead * h * slope < 1) || !std::isfinite(gap)) {  // what outgrows itself: explicit
      ahead = 0;
      at_middle = rate(z, slope);
      end = z + h * value_of(at_middle);
      break;
    }
    if (n > 0 && std::abs(gap) <= settled_memory_change * (std::abs(z) + std::abs(end))) break;
    if (n == 0 && h * slope < -2) ahead = 1 + 1 / (h * slope);
    end -= gap / (1 - ahead * h * slope);
  }
  const Scalar moved = (memory - z) * (1 + (1 - ahead) * h * slope) + h * (at_middle - value_of(at_middle));
  Remembered<Scalar> after;
  after.end = end + moved * (1 / (1 - ahead * h * slope));
  after.in_middle = (1 - ahead) * memory + ahead * after.end;
  return after;
}

/// z where it no longer changes: Newton's steps from nothing. Nothing, where it goes on for ever or stays as it is.
template <class Scalar, class Rate>
Scalar lasting_memory(const Rate& rate) {
  double z = 0;
  for (int n = 0; n < most_memory_steps; ++n) {
    double slope = 0;
    const Scalar at_z = rate(z, slope);
    if (!(slope < 0)) break;
    const double next = z - value_of(at_z) / slope;
    if (!(std::abs(next - z) > settled_memory_change * (std::abs(z) + std::abs(next)))) {
      return z - (at_z - value_of(at_z)) * (1 / slope);
    }
    z = next;
  }
  return Scalar(0.0);
}

/// The rate of a term at a state, over z, in plain numbers. @param x its memory is set @param by out: derivatives by p
inline auto rate_over_memory(const Term& rate, TermInput& x, std::span<const double> p, std::span<double> by) {
  return [&rate, &x, p, by](double z, double& slope) {
    TermInput by_input;
    x.memory = z;
    const double value = rate.evaluate(x, p, by_input, by);
    slope = by_input.memory;
    return value;
  };
}

}  // namespace emtb
