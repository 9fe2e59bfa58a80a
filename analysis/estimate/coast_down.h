#pragma once

#include <span>

#include "analysis/estimate/static_estimate.h"

namespace emtb {

/// Inertia from a coast-down with open armature: J dω/dt = -(T_c + B ω). Gives T_c/J [rad/s2] and B/J [1/s]; with T_c
/// known from elsewhere J [kg m2].
StaticEstimate estimate_coast_down(std::span<const Run> runs, const KnownParameters& known);

}  // namespace emtb
