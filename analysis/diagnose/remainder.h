#pragma once

#include <span>

#include "analysis/diagnose/loss.h"
#include "analysis/diagnose/where.h"
#include "analysis/record/dataset.h"
#include "model/model.h"

namespace emtb {

/// Is what a model leaves worth a name? It is where a signal is above its floor by more than the floor is uncertain,
/// and
///  - either by more than a fiftieth of how much the signal varies, and where the floor is only known to be no lower,
///  by
///    more than the colour of noise could make it,
///  - or it comes again in other runs, or the other half of an only run, as a function of speed, current, direction,
///  angle or the like: then it is a law
///    that the model lacks, however small. A slow disturbance of its own is none.
/// Where a floor is only known to be no higher than it is, nothing can be said of what lies below it.
/// @param inputs signals that only drive the model, of which nothing need be said
bool worth_a_name(const Dataset& data, const Model& model, const Loss& held_out, const Materiality& rule = {},
                  std::span<const Signal> inputs = {});

/// The largest share of the mean square residual of a signal, in the maps of some runs, that its mean as a function of
/// one condition in the maps of other runs takes away.
double reproduced(std::span<const ResidualMap> seen, std::span<const ResidualMap> again, Signal signal);

}  // namespace emtb
