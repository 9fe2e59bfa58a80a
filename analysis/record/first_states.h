#pragma once

#include "analysis/record/record.h"
#include "model/model.h"
#include "model/structure.h"

namespace emtb {

/// The state in which a run starts, as its first readings tell: a run or a span of one may begin while the shaft turns
/// and while the driver is on its way to a reference that was set before.
///  - The speed is that of the straight line through its first readings, or where an encoder's angles stand for it,
///    through those; at rest unless they say otherwise.
///  - The driver stands where its terminals are read to stand, and moves as fast as they are read to. Where they agree
///    with the first reference, or nobody reads them, it is settled there; but at nothing where the shaft is at rest,
///    without a current as far as one is read: then the reference was set as the run began.
///  - The current is the first that is read; where a slow meter reads it, what voltage and speed leave for it.
/// @param observed the run, with all its observations
InitialState first_states(const ObservedRun& observed, const Run& run, const Model& model);

}  // namespace emtb
