#include "analysis/fit/phase_equations.h"

namespace emtb {

PhaseEquations equations_of(std::span<const Residuals> seen, const Knots& knots, std::span<const double> at) {
  PhaseEquations equations(knots, at);
  for (const Residuals& r : seen) {
    if (r.informed()) equations.add(r, knots.of(r));
  }
  return equations;
}

}  // namespace emtb
