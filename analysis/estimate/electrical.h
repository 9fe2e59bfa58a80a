#pragma once

#include <span>

#include "analysis/estimate/settled.h"
#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// Armature resistance and back-EMF constant, as section 3.1 of Erdal et al. (2011) finds them: the line
///
///     e_a / i_a = K_b · (ω / i_a) + R_a                                                                     (6)
///
/// through settled points. Gives R_a [ohm] and K_b [V s/rad]. The error of i_a moves x and y together: both are fitted
/// with it (fit_line). Points whose current is lost in its own error are left out.
StaticEstimate estimate_equation_6(const Settled& settled);

/// The same two from the same points without the division: e_a = R_a i_a + K_b ω, weighed by what the errors of e_a,
/// i_a and ω make of the equation. Better conditioned: a point with little current counts little for R_a instead of
/// much.
StaticEstimate estimate_armature(const Settled& settled);

/// The generator test: K_b [V s/rad] as the slope of the terminal voltage against the speed while no current flows.
/// Uses the stretches with `armature_open`, coasting or driven; else settled points without current.
StaticEstimate estimate_generator(std::span<const Run> runs, const Settled& settled);

}  // namespace emtb
