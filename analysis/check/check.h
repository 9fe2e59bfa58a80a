#pragma once

#include <span>

#include "analysis/check/finding.h"
#include "model/model.h"
#include "session/session.h"

namespace emtb {

/// Looks at recordings before anything is fitted to them.
///
/// A finding needs a contradiction: a second signal, the signal's own noise, the model's bounds, another run. Where
/// nothing contradicts, nothing is found. A measured load, friction, a driver that slews or saturates, a standstill and
/// a coarse instrument are no flaws.
/// @param model where one is given, its bounds, fixed values and priors say what scales are possible
/// @return by run, in the order given; a flaw of all runs together last
DataFindings check(std::span<const Run> train, std::span<const Run> held_out = {}, const Model* model = nullptr);

/// Whether a fit would mean nothing.
bool stops(const DataFindings& findings);

}  // namespace emtb
